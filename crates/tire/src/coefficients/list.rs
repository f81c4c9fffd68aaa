//! Lists the keys of the Magic Formula 5.2, PAC2002, 6.1 and 6.2 by the sections of a `.tir` file: quantity, default, the versions
//! that use the key, and what it is.

/// Gives the list to another macro.
macro_rules! with_all_keys {
    ($macro:ident) => {
        $macro! {
            MODEL {
                LONGVL: Speed = 16.7, ALL, "Nominal speed V0, that of the measurements.";
                VXLOW: Speed = 1.0, ALL, "Forward speed below which slips and shifts fade.";
            }
            DIMENSION {
                UNLOADED_RADIUS: Length = 0.3, ALL, "Radius of the free tire at rest, R0.";
                WIDTH: Length = 0.2, ALL, "Width of the tire.";
                ASPECT_RATIO: Ratio = 0.6, ONLY_62, "Height of the section divided by its width.";
                RIM_RADIUS: Length = 0.2, NONE, "Radius of the rim.";
                RIM_WIDTH: Length = 0.15, NONE, "Width of the rim.";
            }
            OPERATING_CONDITIONS {
                INFLPRES: Pressure = 220_000.0, ALL, "Inflation pressure where none is given.";
                NOMPRES: Pressure = 220_000.0, ALL, "Nominal inflation pressure, p_i0.";
            }
            VERTICAL {
                FNOMIN: Force = 4000.0, ALL, "Nominal load F_z0.";
                VERTICAL_STIFFNESS: Stiffness = 200_000.0, ALL, "Vertical stiffness C_z0 at nominal load and pressure.";
                VERTICAL_DAMPING: Damping = 0.0, NONE, "Vertical damping.";
                BREFF: Ratio = 0.0, ALL, "Effective radius: stiffness of the fall at low load.";
                DREFF: Ratio = 0.0, ALL, "Effective radius: peak of the fall.";
                FREFF: Ratio = 0.0, ALL, "Effective radius: share of the deflection at high load.";
                Q_RE0: Ratio = 1.0, ALL, "Ratio of the free radius at speed 0 to the unloaded radius.";
                Q_V1: Ratio = 0.0, ALL, "Growth of the free radius with the square of the wheel speed.";
                Q_V2: Ratio = 0.0, SINCE_61, "Growth of the vertical stiffness with the wheel speed.";
                Q_FZ2: Ratio = 0.0, SINCE_61, "Growth of the vertical stiffness with the deflection.";
                Q_FCX: Ratio = 0.0, SINCE_61, "Fall of the load at a deflection by longitudinal force.";
                Q_FCY: Ratio = 0.0, SINCE_61, "Fall of the load at a deflection by lateral force.";
                Q_FCY2: Ratio = 0.0, ONLY_62, "Exponent of the deflection in the effect of the lateral force.";
                Q_CAM1: InverseLength = 0.0, ONLY_62, "Deflection by camber, linear in the loaded radius.";
                Q_CAM2: InverseArea = 0.0, ONLY_62, "Deflection by camber, square in the loaded radius.";
                Q_CAM3: Ratio = 0.0, ONLY_62, "Fall of the deflection with camber.";
                Q_FYS1: Force = 0.0, ONLY_62, "Shift of the lateral force with camber, constant.";
                Q_FYS2: Force = 0.0, ONLY_62, "Shift of the lateral force with camber, linear in the loaded radius.";
                Q_FYS3: Force = 0.0, ONLY_62, "Shift of the lateral force with camber, square in the loaded radius.";
                PFZ1: Ratio = 0.0, ALL, "Growth of the vertical stiffness with pressure.";
                BOTTOM_OFFST: Length = 0.0, NONE, "Distance of the rim to the road where it touches the ground.";
                BOTTOM_STIFF: Stiffness = 0.0, NONE, "Stiffness of the rim on the ground.";
            }
            STRUCTURAL {
                LONGITUDINAL_STIFFNESS: Stiffness = 400_000.0, SINCE_61, "Longitudinal stiffness of the carcass.";
                LATERAL_STIFFNESS: Stiffness = 150_000.0, SINCE_61, "Lateral stiffness of the carcass.";
                PCFX1: Ratio = 0.0, SINCE_61, "Longitudinal stiffness, linear in load.";
                PCFX2: Ratio = 0.0, SINCE_61, "Longitudinal stiffness, square in load.";
                PCFX3: Ratio = 0.0, SINCE_61, "Longitudinal stiffness, linear in pressure.";
                PCFY1: Ratio = 0.0, SINCE_61, "Lateral stiffness, linear in load.";
                PCFY2: Ratio = 0.0, SINCE_61, "Lateral stiffness, square in load.";
                PCFY3: Ratio = 0.0, SINCE_61, "Lateral stiffness, linear in pressure.";
            }
            CONTACT_PATCH {
                Q_RA1: Ratio = 0.0, SINCE_61, "Contact length, square root of the deflection.";
                Q_RA2: Ratio = 0.0, SINCE_61, "Contact length, linear in the deflection.";
                Q_RB1: Ratio = 0.0, SINCE_61, "Contact width, cube root of the deflection.";
                Q_RB2: Ratio = 0.0, SINCE_61, "Contact width, linear in the deflection.";
                Q_A1: Ratio = 0.0, BEFORE_61, "Contact length, square root of the load.";
                Q_A2: Ratio = 0.0, BEFORE_61, "Contact length, linear in the load.";
            }
            INFLATION_PRESSURE_RANGE {
                PRESMIN: Pressure = 10_000.0, ALL, "Lowest valid inflation pressure.";
                PRESMAX: Pressure = 1_000_000.0, ALL, "Highest valid inflation pressure.";
            }
            VERTICAL_FORCE_RANGE {
                FZMIN: Force = 0.0, ALL, "Lowest valid load.";
                FZMAX: Force = 1_000_000.0, ALL, "Highest valid load.";
            }
            LONG_SLIP_RANGE {
                KPUMIN: Ratio = -1.5, ALL, "Lowest valid longitudinal slip.";
                KPUMAX: Ratio = 1.5, ALL, "Highest valid longitudinal slip.";
            }
            SLIP_ANGLE_RANGE {
                ALPMIN: Angle = -1.5, ALL, "Lowest valid slip angle.";
                ALPMAX: Angle = 1.5, ALL, "Highest valid slip angle.";
            }
            INCLINATION_ANGLE_RANGE {
                CAMMIN: Angle = -0.5, ALL, "Lowest valid camber.";
                CAMMAX: Angle = 0.5, ALL, "Highest valid camber.";
            }
            SCALING_COEFFICIENTS {
                LFZO: Ratio = 1.0, ALL, "Scale: nominal load.";
                LCX: Ratio = 1.0, ALL, "Scale: shape factor of F_x.";
                LMUX: Ratio = 1.0, ALL, "Scale: longitudinal friction.";
                LEX: Ratio = 1.0, ALL, "Scale: curvature of F_x.";
                LKX: Ratio = 1.0, ALL, "Scale: longitudinal slip stiffness.";
                LHX: Ratio = 1.0, ALL, "Scale: horizontal shift of F_x.";
                LVX: Ratio = 1.0, ALL, "Scale: vertical shift of F_x.";
                LCY: Ratio = 1.0, ALL, "Scale: shape factor of F_y.";
                LMUY: Ratio = 1.0, ALL, "Scale: lateral friction.";
                LEY: Ratio = 1.0, ALL, "Scale: curvature of F_y.";
                LKY: Ratio = 1.0, ALL, "Scale: cornering stiffness.";
                LHY: Ratio = 1.0, ALL, "Scale: horizontal shift of F_y.";
                LVY: Ratio = 1.0, ALL, "Scale: vertical shift of F_y.";
                LTR: Ratio = 1.0, ALL, "Scale: pneumatic trail.";
                LRES: Ratio = 1.0, ALL, "Scale: residual torque.";
                LXAL: Ratio = 1.0, ALL, "Scale: effect of slip angle on F_x.";
                LYKA: Ratio = 1.0, ALL, "Scale: effect of longitudinal slip on F_y.";
                LVYKA: Ratio = 1.0, ALL, "Scale: lateral force that longitudinal slip makes.";
                LS: Ratio = 1.0, ALL, "Scale: lever arm of F_x about the vertical axis.";
                LKYC: Ratio = 1.0, ALL, "Scale: camber stiffness of F_y.";
                LKZC: Ratio = 1.0, ALL, "Scale: camber stiffness of M_z.";
                LVMX: Ratio = 1.0, ALL, "Scale: shift of M_x.";
                LMX: Ratio = 1.0, ALL, "Scale: overturning moment.";
                LMY: Ratio = 1.0, ALL, "Scale: rolling resistance.";
                LGAX: Ratio = 1.0, BEFORE_61, "Scale: camber in F_x.";
                LGAY: Ratio = 1.0, BEFORE_61, "Scale: camber in F_y.";
                LGAZ: Ratio = 1.0, BEFORE_61, "Scale: camber in M_z.";
                LSGKP: Ratio = 1.0, BEFORE_61, "Scale: longitudinal relaxation length.";
                LSGAL: Ratio = 1.0, BEFORE_61, "Scale: lateral relaxation length.";
                LMUV: Ratio = 0.0, ALL, "Fall of friction with slip speed.";
            }
            LONGITUDINAL_COEFFICIENTS {
                PCX1: Ratio = 1.0, ALL, "Shape factor of F_x.";
                PDX1: Ratio = 0.0, ALL, "Longitudinal friction at nominal load.";
                PDX2: Ratio = 0.0, ALL, "Longitudinal friction, linear in load.";
                PDX3: Ratio = 0.0, ALL, "Longitudinal friction, square in camber.";
                PEX1: Ratio = 0.0, ALL, "Curvature of F_x at nominal load.";
                PEX2: Ratio = 0.0, ALL, "Curvature of F_x, linear in load.";
                PEX3: Ratio = 0.0, ALL, "Curvature of F_x, square in load.";
                PEX4: Ratio = 0.0, ALL, "Difference of the curvature of F_x between driving and braking.";
                PKX1: Ratio = 0.0, ALL, "Longitudinal slip stiffness divided by load.";
                PKX2: Ratio = 0.0, ALL, "Longitudinal slip stiffness, linear in load.";
                PKX3: Ratio = 0.0, ALL, "Longitudinal slip stiffness, exponent of load.";
                PHX1: Ratio = 0.0, ALL, "Horizontal shift of F_x at nominal load.";
                PHX2: Ratio = 0.0, ALL, "Horizontal shift of F_x, linear in load.";
                PVX1: Ratio = 0.0, ALL, "Vertical shift of F_x divided by load.";
                PVX2: Ratio = 0.0, ALL, "Vertical shift of F_x, linear in load.";
                PPX1: Ratio = 0.0, AFTER_52, "Longitudinal slip stiffness, linear in pressure.";
                PPX2: Ratio = 0.0, AFTER_52, "Longitudinal slip stiffness, square in pressure.";
                PPX3: Ratio = 0.0, AFTER_52, "Longitudinal friction, linear in pressure.";
                PPX4: Ratio = 0.0, AFTER_52, "Longitudinal friction, square in pressure.";
                RBX1: Ratio = 0.0, ALL, "Slope of the fall of F_x with slip angle.";
                RBX2: Ratio = 0.0, ALL, "Slope of the fall of F_x with slip angle, over longitudinal slip.";
                RBX3: Ratio = 0.0, SINCE_61, "Slope of the fall of F_x with slip angle, square in camber.";
                RCX1: Ratio = 1.0, ALL, "Shape factor of the fall of F_x.";
                REX1: Ratio = 0.0, ALL, "Curvature of the fall of F_x.";
                REX2: Ratio = 0.0, ALL, "Curvature of the fall of F_x, linear in load.";
                RHX1: Ratio = 0.0, ALL, "Shift of the fall of F_x.";
                PTX1: Ratio = 0.0, BEFORE_61, "Longitudinal relaxation length at nominal load.";
                PTX2: Ratio = 0.0, BEFORE_61, "Longitudinal relaxation length, linear in load.";
                PTX3: Ratio = 0.0, BEFORE_61, "Longitudinal relaxation length, exponent of load.";
            }
            OVERTURNING_COEFFICIENTS {
                QSX1: Ratio = 0.0, ALL, "Shift of the overturning moment.";
                QSX2: Ratio = 0.0, ALL, "Overturning moment by camber.";
                QSX3: Ratio = 0.0, ALL, "Overturning moment by lateral force.";
                QSX4: Ratio = 0.0, AFTER_52, "Overturning moment by load, lateral force and camber together.";
                QSX5: Ratio = 0.0, AFTER_52, "Shape of the effect of load.";
                QSX6: Ratio = 0.0, AFTER_52, "Slope of the effect of load.";
                QSX7: Ratio = 0.0, AFTER_52, "Effect of camber within the term of QSX4.";
                QSX8: Ratio = 0.0, AFTER_52, "Effect of lateral force within the term of QSX4.";
                QSX9: Ratio = 0.0, AFTER_52, "Slope of the effect of lateral force.";
                QSX10: Ratio = 0.0, AFTER_52, "Overturning moment by load and camber.";
                QSX11: Ratio = 0.0, AFTER_52, "Slope of the effect of load and camber.";
                QSX12: Ratio = 0.0, SINCE_61, "Overturning moment, square in camber.";
                QSX13: Ratio = 0.0, SINCE_61, "Lever arm of the lateral force.";
                QSX14: Ratio = 0.0, SINCE_61, "Lever arm of the lateral force, by camber.";
                PPMX1: Ratio = 0.0, AFTER_52, "Overturning moment by camber, linear in pressure.";
            }
            LATERAL_COEFFICIENTS {
                PCY1: Ratio = 1.0, ALL, "Shape factor of F_y.";
                PDY1: Ratio = 0.0, ALL, "Lateral friction at nominal load.";
                PDY2: Ratio = 0.0, ALL, "Lateral friction, linear in load.";
                PDY3: Ratio = 0.0, ALL, "Lateral friction, square in camber.";
                PEY1: Ratio = 0.0, ALL, "Curvature of F_y at nominal load.";
                PEY2: Ratio = 0.0, ALL, "Curvature of F_y, linear in load.";
                PEY3: Ratio = 0.0, ALL, "Difference of the curvature of F_y between the sides.";
                PEY4: Ratio = 0.0, ALL, "Difference of the curvature of F_y between the sides, by camber.";
                PEY5: Ratio = 0.0, SINCE_61, "Curvature of F_y, square in camber.";
                PKY1: Ratio = 0.0, ALL, "Largest cornering stiffness divided by nominal load; below 0 in ISO-W axes.";
                PKY2: Ratio = 1.0, ALL, "Load of the largest cornering stiffness divided by nominal load.";
                PKY3: Ratio = 0.0, ALL, "Cornering stiffness, by camber.";
                PKY4: Ratio = 2.0, SINCE_61, "Shape of cornering stiffness over load.";
                PKY5: Ratio = 0.0, SINCE_61, "Load of the largest cornering stiffness, square in camber.";
                PKY6: Ratio = 0.0, SINCE_61, "Camber stiffness divided by load.";
                PKY7: Ratio = 0.0, SINCE_61, "Camber stiffness, linear in load.";
                PHY1: Ratio = 0.0, ALL, "Horizontal shift of F_y at nominal load.";
                PHY2: Ratio = 0.0, ALL, "Horizontal shift of F_y, linear in load.";
                PHY3: Ratio = 0.0, BEFORE_61, "Horizontal shift of F_y, by camber.";
                PVY1: Ratio = 0.0, ALL, "Vertical shift of F_y divided by load.";
                PVY2: Ratio = 0.0, ALL, "Vertical shift of F_y, linear in load.";
                PVY3: Ratio = 0.0, ALL, "Vertical shift of F_y, by camber.";
                PVY4: Ratio = 0.0, ALL, "Vertical shift of F_y, by camber and load.";
                PPY1: Ratio = 0.0, AFTER_52, "Cornering stiffness, linear in pressure.";
                PPY2: Ratio = 0.0, AFTER_52, "Load of the largest cornering stiffness, linear in pressure.";
                PPY3: Ratio = 0.0, AFTER_52, "Lateral friction, linear in pressure.";
                PPY4: Ratio = 0.0, AFTER_52, "Lateral friction, square in pressure.";
                PPY5: Ratio = 0.0, SINCE_61, "Camber stiffness, linear in pressure.";
                RBY1: Ratio = 0.0, ALL, "Slope of the fall of F_y with longitudinal slip.";
                RBY2: Ratio = 0.0, ALL, "Slope of the fall of F_y with longitudinal slip, over slip angle.";
                RBY3: Ratio = 0.0, ALL, "Slip angle where that slope is largest.";
                RBY4: Ratio = 0.0, SINCE_61, "Slope of the fall of F_y with longitudinal slip, square in camber.";
                RCY1: Ratio = 1.0, ALL, "Shape factor of the fall of F_y.";
                REY1: Ratio = 0.0, ALL, "Curvature of the fall of F_y.";
                REY2: Ratio = 0.0, ALL, "Curvature of the fall of F_y, linear in load.";
                RHY1: Ratio = 0.0, ALL, "Shift of the fall of F_y.";
                RHY2: Ratio = 0.0, ALL, "Shift of the fall of F_y, linear in load.";
                RVY1: Ratio = 0.0, ALL, "Lateral force that longitudinal slip makes, divided by the peak.";
                RVY2: Ratio = 0.0, ALL, "Lateral force that longitudinal slip makes, linear in load.";
                RVY3: Ratio = 0.0, ALL, "Lateral force that longitudinal slip makes, by camber.";
                RVY4: Ratio = 0.0, ALL, "Its fall with slip angle.";
                RVY5: Ratio = 0.0, ALL, "Its shape over longitudinal slip.";
                RVY6: Ratio = 0.0, ALL, "Its slope over longitudinal slip.";
                PTY1: Ratio = 0.0, BEFORE_61, "Largest lateral relaxation length divided by radius.";
                PTY2: Ratio = 1.0, BEFORE_61, "Load of the largest lateral relaxation length divided by nominal load.";
            }
            ROLLING_COEFFICIENTS {
                QSY1: Ratio = 0.0, ALL, "Rolling resistance divided by load.";
                QSY2: Ratio = 0.0, ALL, "Rolling resistance by longitudinal force.";
                QSY3: Ratio = 0.0, ALL, "Rolling resistance, linear in speed.";
                QSY4: Ratio = 0.0, ALL, "Rolling resistance, fourth power of speed.";
                QSY5: Ratio = 0.0, AFTER_52, "Rolling resistance, square in camber.";
                QSY6: Ratio = 0.0, AFTER_52, "Rolling resistance, square in camber, by load.";
                QSY7: Ratio = 1.0, AFTER_52, "Rolling resistance, exponent of load.";
                QSY8: Ratio = 0.0, AFTER_52, "Rolling resistance, exponent of pressure.";
            }
            ALIGNING_COEFFICIENTS {
                QBZ1: Ratio = 0.0, ALL, "Slope of the trail at nominal load.";
                QBZ2: Ratio = 0.0, ALL, "Slope of the trail, linear in load.";
                QBZ3: Ratio = 0.0, ALL, "Slope of the trail, square in load.";
                QBZ4: Ratio = 0.0, ALL, "Slope of the trail, by camber.";
                QBZ5: Ratio = 0.0, ALL, "Slope of the trail, by camber whatever its sign.";
                QBZ9: Ratio = 0.0, ALL, "Slope of the residual torque.";
                QBZ10: Ratio = 0.0, ALL, "Slope of the residual torque, by that of F_y.";
                QCZ1: Ratio = 1.0, ALL, "Shape factor of the trail.";
                QDZ1: Ratio = 0.0, ALL, "Peak of the trail divided by radius.";
                QDZ2: Ratio = 0.0, ALL, "Peak of the trail, linear in load.";
                QDZ3: Ratio = 0.0, ALL, "Peak of the trail, by camber.";
                QDZ4: Ratio = 0.0, ALL, "Peak of the trail, square in camber.";
                QDZ6: Ratio = 0.0, ALL, "Residual torque divided by load and radius.";
                QDZ7: Ratio = 0.0, ALL, "Residual torque, linear in load.";
                QDZ8: Ratio = 0.0, ALL, "Residual torque, by camber.";
                QDZ9: Ratio = 0.0, ALL, "Residual torque, by camber and load.";
                QDZ10: Ratio = 0.0, SINCE_61, "Residual torque, square in camber.";
                QDZ11: Ratio = 0.0, SINCE_61, "Residual torque, square in camber, by load.";
                QEZ1: Ratio = 0.0, ALL, "Curvature of the trail at nominal load.";
                QEZ2: Ratio = 0.0, ALL, "Curvature of the trail, linear in load.";
                QEZ3: Ratio = 0.0, ALL, "Curvature of the trail, square in load.";
                QEZ4: Ratio = 0.0, ALL, "Curvature of the trail, by the side of slip.";
                QEZ5: Ratio = 0.0, ALL, "Curvature of the trail, by the side of slip and camber.";
                QHZ1: Ratio = 0.0, ALL, "Shift of the trail at nominal load.";
                QHZ2: Ratio = 0.0, ALL, "Shift of the trail, linear in load.";
                QHZ3: Ratio = 0.0, ALL, "Shift of the trail, by camber.";
                QHZ4: Ratio = 0.0, ALL, "Shift of the trail, by camber and load.";
                PPZ1: Ratio = 0.0, AFTER_52, "Peak of the trail, linear in pressure.";
                PPZ2: Ratio = 0.0, AFTER_52, "Residual torque by camber, linear in pressure.";
                SSZ1: Ratio = 0.0, ALL, "Lever arm of F_x divided by radius.";
                SSZ2: Ratio = 0.0, ALL, "Lever arm of F_x, by lateral force.";
                SSZ3: Ratio = 0.0, ALL, "Lever arm of F_x, by camber.";
                SSZ4: Ratio = 0.0, ALL, "Lever arm of F_x, by camber and load.";
            }
        }
    };
}
