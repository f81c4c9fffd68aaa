//! Looks at what was estimated beside the tires: whether it can be what its name says, or stands for something that the model
//! does not have.

use kalman::augmented::ColouredNoise;
use tire_inference::model::FitTest;

use super::CHANNELS;

/// Standard deviations before any data beyond which an error is none of a sensor.
const FAR: f64 = 3.0;
/// Time that the noise of a sensor lasts at most [s].
const LASTS: f64 = 1.0;
/// Share of the variance of a noise below which it may last as long as it likes.
const SLIGHT: f64 = 0.05;

/// The name of the test of an error.
pub fn plausibility_test_name(error: &str) -> String {
    format!("plausibility of {error}")
}

/// The test of an error that would have to be `figure`, in words; `size` is in its standard deviations before any data.
pub fn error_plausibility_test(error: &str, title: &str, figure: &str, size: f64) -> FitTest {
    FitTest {
        name: plausibility_test_name(error),
        statistic: size.abs(),
        limit: FAR,
        sentence: format!(
            "The {title} would have to be {figure}, {:.1} times what is expected of it: it stands for something that the model does not have. If it is true, write it into the log or the car, or give it an `error_std`.",
            size.abs()
        ),
    }
}

/// The test of a noise of a channel, with its standard deviation, of which a share is correlated from row to row over a step [s].
pub fn noise_plausibility_test(
    error: &str,
    channel: usize,
    std: f64,
    ColouredNoise { correlation, share }: ColouredNoise<f64>,
    step: f64,
) -> FitTest {
    let lasts = -step / correlation.ln();
    let slow = std * share.sqrt();
    let unit = ["m/s", "m/s", "rad/s", "m/s²"][channel];
    let such = [
        "wheels that slip, or a drifting sensor",
        "a sensor of v_y that drifts or is at another place, or wind",
        "a drifting gyro",
        "the bank of the road, the roll of the body under the accelerometer, or its drift",
    ][channel];
    FitTest {
        name: plausibility_test_name(error),
        statistic: if share < SLIGHT { 0.0 } else { lasts },
        limit: LASTS,
        sentence: format!(
            "{} differs from the model by something slow, {slow:.2} {unit} that last for {lasts:.0} s, as no noise of a sensor does: such as {such}.",
            CHANNELS[channel]
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_noise_is_slow_by_seconds_not_by_rows() {
        let of = |correlation, share, step| {
            noise_plausibility_test("colour_a_y", 3, 1.4, ColouredNoise { correlation, share }, step)
        };
        assert!(of(0.98, 0.5, 0.01).has_passed());
        assert!(!of(0.98, 0.5, 0.1).has_passed());
        let slow = of(0.999, 0.5, 0.01);
        assert!(!slow.has_passed());
        assert!(
            slow.sentence
                .starts_with("a_y differs from the model by something slow, 0.99 m/s² that last for 10 s"),
            "{}",
            slow.sentence
        );
        assert!(of(0.999, 0.01, 0.01).has_passed());
    }

    #[test]
    fn an_error_beyond_three_standard_deviations_is_none_of_a_sensor() {
        assert!(error_plausibility_test("a_y_lever", "lever", "+1.40 m", 2.8).has_passed());
        assert!(!error_plausibility_test("a_y_lever", "lever", "-2.16 m", -4.3).has_passed());
    }
}
