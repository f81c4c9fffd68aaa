//! Writes the invented tires of the scenarios: `cargo run -p tire-file --example sports_tire -- front > front.tir`.

use tire::Coefficients;

fn main() {
    let is_rear = std::env::args().nth(1).is_some_and(|axle| axle == "rear");
    let front = Coefficients::sports_tire();
    let tire = if is_rear {
        // Wider: it carries more, and is stiffer.
        Coefficients {
            WIDTH: 0.255,
            ASPECT_RATIO: 0.4,
            FNOMIN: 4500.0,
            VERTICAL_STIFFNESS: 240_000.0,
            LATERAL_STIFFNESS: 170_000.0,
            PKY1: -23.5,
            PDY1: 1.13,
            PKX1: 24.5,
            PDX1: 1.21,
            ..front
        }
    } else {
        front
    };
    let size = if is_rear { "255/40 R 17, rear" } else { "225/45 R 17, front" };
    let about = [format!("Sports tire {size}: invented coefficients of usual size, of no real product.")];
    print!("{}", tire_file::write_tir_text(&tire, &about));
}
