//! Provides coefficients of an invented tire, for cars that were given none.

use crate::coefficients::{Coefficients, MagicFormulaVersion};

impl Coefficients {
    /// A sporty road tire 225/45 R 17 by the Magic Formula 6.2. Its coefficients are invented, of usual size, and without ply
    /// steer or conicity: it is the same on both sides of a car.
    pub fn sports_tire() -> Self {
        Self {
            version: MagicFormulaVersion::Mf62,
            ..Self::base_coefficients().with_longitudinal().with_lateral().with_aligning_moment()
        }
    }

    fn base_coefficients() -> Self {
        Self {
            UNLOADED_RADIUS: 0.317,
            WIDTH: 0.225,
            ASPECT_RATIO: 0.45,
            RIM_RADIUS: 0.216,
            RIM_WIDTH: 0.19,
            INFLPRES: 230_000.0,
            NOMPRES: 230_000.0,
            FNOMIN: 4000.0,
            VERTICAL_STIFFNESS: 225_000.0,
            VERTICAL_DAMPING: 60.0,
            BREFF: 8.0,
            DREFF: 0.28,
            FREFF: 0.06,
            Q_V1: 6e-4,
            Q_V2: 0.04,
            Q_FZ2: 13.0,
            Q_FCX: 0.1,
            Q_FCY: 0.12,
            Q_FCY2: -0.4,
            Q_CAM1: 80.0,
            Q_CAM2: 220.0,
            Q_CAM3: 0.4,
            PFZ1: 0.7,
            LONGITUDINAL_STIFFNESS: 360_000.0,
            LATERAL_STIFFNESS: 155_000.0,
            PCFX1: 0.16,
            PCFX3: 0.2,
            PCFY1: 0.14,
            PCFY3: 0.25,
            Q_RA1: 0.65,
            Q_RA2: 0.7,
            Q_RB1: 1.0,
            Q_RB2: -1.1,
            PRESMIN: 120_000.0,
            PRESMAX: 350_000.0,
            FZMIN: 100.0,
            FZMAX: 11_000.0,
            KPUMIN: -1.0,
            KPUMAX: 1.0,
            ALPMIN: -0.6,
            ALPMAX: 0.6,
            CAMMIN: -0.2,
            CAMMAX: 0.2,
            ..Self::default()
        }
    }

    fn with_longitudinal(self) -> Self {
        Self {
            PCX1: 1.6,
            PDX1: 1.18,
            PDX2: -0.09,
            PDX3: 0.7,
            PEX1: 0.1,
            PEX2: 0.2,
            PKX1: 23.0,
            PKX2: 1.5,
            PKX3: -0.1,
            PPX1: -0.35,
            PPX2: 0.3,
            PPX3: -0.09,
            PPX4: 0.06,
            RBX1: 13.0,
            RBX2: 10.5,
            RCX1: 1.05,
            REX1: -0.3,
            QSX2: 0.8,
            QSX3: 0.02,
            QSY1: 0.009,
            QSY3: 0.001,
            QSY7: 0.9,
            QSY8: -0.4,
            ..self
        }
    }

    fn with_lateral(self) -> Self {
        Self {
            PCY1: 1.35,
            PDY1: 1.1,
            PDY2: -0.12,
            PDY3: 1.5,
            PEY1: -0.6,
            PEY2: -0.4,
            PEY4: -4.0,
            PKY1: -21.0,
            PKY2: 1.85,
            PKY3: 0.4,
            PKY6: -0.95,
            PKY7: -0.2,
            PVY3: -0.25,
            PVY4: -0.3,
            PPY1: 0.45,
            PPY2: 0.7,
            PPY3: -0.1,
            PPY4: 0.15,
            PPY5: -0.5,
            RBY1: 12.0,
            RBY2: 8.5,
            RCY1: 1.04,
            REY1: 0.2,
            ..self
        }
    }

    fn with_aligning_moment(self) -> Self {
        Self {
            QBZ1: 11.0,
            QBZ2: -1.7,
            QBZ9: 17.0,
            QCZ1: 1.2,
            QDZ1: 0.1,
            QDZ2: -0.007,
            QDZ8: -0.12,
            QDZ9: 0.02,
            QEZ1: -1.7,
            QEZ2: 0.7,
            QHZ3: 0.1,
            PPZ1: -0.3,
            SSZ3: 0.2,
            ..self
        }
    }
}
