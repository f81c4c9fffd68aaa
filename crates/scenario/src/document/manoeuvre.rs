//! The keys of `[[manoeuvre]]`, a driving test of a standard.

use std::sync::Arc;

use diagnostics::Spanned;
use manoeuvre::kind::ManoeuvreKind;
use manoeuvre::{Direction, PathFollower, SpeedController, for_each_kind};
use schemars::JsonSchema;
use serde::Deserialize;

macro_rules! manoeuvre {
    ($($key:ident: $kind:ident,)*) => {
        /// A driving test of a standard. A driver, who is a node of the scenario, steers and drives the car by what it measures; afterwards
        /// checks can use the characteristic values: `test.yaw_rate_gain`.
        ///
        /// ```toml
        /// [[manoeuvre]]
        /// name = "test"
        /// entry_speed = 22.2
        /// car = "plant"
        /// step_steer = { amplitude = 0.02 }
        ///
        /// [[connect]]
        /// from = "driver.steer"
        /// to = "plant.delta"
        ///
        /// [[connect]]
        /// from = "driver.drive"
        /// to = "plant.F_x"
        /// ```
        #[derive(Debug, Deserialize, JsonSchema)]
        #[serde(deny_unknown_fields)]
        pub struct Manoeuvre {
            /// Name of the test and of its values in checks and reports.
            #[schemars(example = &"test")]
            pub name: Spanned<String>,
            /// Name of the driver's node; `driver` without it.
            #[schemars(example = &"driver")]
            pub driver: Option<Spanned<String>>,
            /// Node that the driver measures, by the usual names: `v_x`, `v_y`, `r`, `a_y`, `X`, `Y`, `psi`. An input of the driver with a
            /// connection of its own keeps that one.
            #[schemars(example = &"plant")]
            pub car: Option<Spanned<String>>,
            /// Speed at which the test begins [m/s].
            #[schemars(with = "f64", example = 22.2)]
            pub entry_speed: Spanned<f64>,
            /// How far the speed may be off when the test begins [m/s]; 0.3 m/s without it.
            #[schemars(with = "Option<f64>", example = 0.3)]
            pub speed_tolerance: Option<Spanned<f64>>,
            /// How long the speed must be right before the test begins [s]; 1 s without it.
            #[schemars(with = "Option<f64>", example = 1.0)]
            pub settle: Option<Spanned<f64>>,
            /// Direction of the first steering.
            #[serde(default)]
            #[schemars(example = &"right")]
            pub direction: Direction,
            /// Wheelbase of the car, for a driver who follows a path [m]; 2.7 m without it.
            #[schemars(with = "Option<f64>", example = 2.55)]
            pub wheelbase: Option<Spanned<f64>>,
            /// Angle of the steering wheel over that of the front wheels [-], for the output `hand_wheel` of the driver;
            /// 1 without it.
            #[schemars(with = "Option<f64>", example = 15.0)]
            pub steering_ratio: Option<Spanned<f64>>,
            /// Gains of the speed controller.
            pub speed_controller: Option<Spanned<SpeedController>>,
            /// Gains of the path follower.
            pub path_follower: Option<Spanned<PathFollower>>,
            $(
                #[allow(missing_docs, reason = "the words of the kind are documented with their type")]
                pub $key: Option<Spanned<manoeuvre::kind::$kind>>,
            )*
        }

        impl Manoeuvre {
            /// The keys of all kinds.
            pub const KINDS: &[&str] = &[$(stringify!($key)),*];

            /// The given kinds, each with its key and its place.
            #[must_use]
            pub fn kinds(&self) -> Vec<(&'static str, Spanned<Arc<dyn ManoeuvreKind>>)> {
                let mut kinds: Vec<(_, Spanned<Arc<dyn ManoeuvreKind>>)> = Vec::new();
                $(kinds.extend(self.$key.as_ref().map(|it| {
                    let kind: Arc<dyn ManoeuvreKind> = Arc::new(it.get_ref().clone());
                    (stringify!($key), Spanned::new(it.span(), kind))
                }));)*
                kinds
            }
        }
    };
}
for_each_kind!(manoeuvre);

impl Manoeuvre {
    /// The name of the driver's node.
    #[must_use]
    pub fn driver_node_name(&self) -> &str {
        self.driver.as_ref().map_or("driver", |word| word.get_ref())
    }

    /// The word that names the driver's node, or else the test.
    #[must_use]
    pub fn driver_or_name(&self) -> &Spanned<String> {
        self.driver.as_ref().unwrap_or(&self.name)
    }
}
