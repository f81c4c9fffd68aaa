//! Times one evaluation.
use identify::closed_loop::*;
fn main() {
    let path = std::env::args().nth(1).unwrap();
    let text = std::fs::read_to_string(path).unwrap();
    let mut lines = text.lines();
    let head: Vec<&str> = lines.next().unwrap().split(',').collect();
    let rows: Vec<Vec<f64>> = lines.map(|l| l.split(',').map(|x| x.parse().unwrap()).collect()).collect();
    let col = |n: &str| { let i = head.iter().position(|h| *h == n).unwrap(); rows.iter().map(|r| r[i]).collect::<Vec<_>>() };
    let rec = Recording { t: col("time"), v_x: col("estimator.v_x_meas"), v_y: col("estimator.v_y_meas"), r: col("estimator.r_meas"), a_y: col("estimator.a_y_meas"), F_x: col("plant.F_x"), delta: col("plant.delta") };
    rec.check(0).unwrap();
    println!("{:?}", rec.rough_noise());
    let l = Likelihood::new(&vehicle::Vehicle::default(), &[rec]);
    let th = [22., 1.8, 1.6, 0.8, 22., 1.8, 1.6, 0.8];
    let noise = Noise::of_sensors([0.05, 0.01, 0.01, 0.1]);
    for _ in 0..10 {
        let s = std::time::Instant::now();
        let e = l.of_tires(&th, &noise);
        let a = s.elapsed();
        let s = std::time::Instant::now();
        let c = l.cost(&th, &noise);
        println!("{:?} {:?} {} {} {:?}", a, s.elapsed(), e.cost, c, e.mean_square);
    }
    let e = l.of_tires(&th, &noise);
    for i in 0..8 { let h = 1e-5; let mut a = th; a[i] += h; let mut b = th; b[i] -= h;
        println!("{} {} sd {}", e.gradient[i], (l.cost(&a, &noise) - l.cost(&b, &noise)) / 2.0 / h, 1.0 / e.information[i][i].sqrt()); }
}
