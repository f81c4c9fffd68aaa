//! Reads files of TYDEX as benches and careless programs write them, good and bad.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use tire_bench::{BenchReadOptions, BenchSample, read_bench_file, read_bench_files};

fn refused(bytes: &[u8], reading: &BenchReadOptions) -> String {
    read_bench_file(bytes, "a", 0, reading).map(|it| it.samples.len()).expect_err("refused").to_string()
}

/// A file of TYDEX as benches lay it out; the load is a constant, the slip ratio in percent, angles have a factor.
fn tydex(axes: &str, load: f64) -> String {
    let line = |name: &str, unit: &str, numbers: &str| {
        format!("{name:<10}{:<30}{unit:<10}{numbers}\r\n", "a comment, FX 3")
    };
    let mut text = "**HEADER\r\n".to_owned();
    text += &format!("{:<10}{:<40}{}\r\n", "RELEASE", "Release of TYDEX-Format", "1.3");
    text += "**COMMENTS\r\nall of it: **bold** words, 1,5\r\n\r\n**CONSTANTS\r\n";
    text += &line("INFLPRES", "bar", "2.1");
    text += &line(&format!("FZ{axes}"), "N", &load.to_string());
    text += &line("LOCATION", "", "HERE");
    text += "**MEASURCHANNELS\r\n! Name    Comment\r\n";
    for (name, unit, numbers) in [
        ("RUNTIME", "s", "1"),
        ("TRAJVELW", "km/h", "1         0         0"),
        ("LONGSLIP", "%", ""),
        ("SLIPANGL", "deg", "0.1       0         0.5"),
        ("INCLANGL", "deg", "1.0D+00"),
    ] {
        text += &line(name, unit, numbers);
    }
    for name in ["FX", "FY", "MZ"] {
        text += &line(&format!("{name}{axes}"), if name == "MZ" { "Nm" } else { "kN" }, "1");
    }
    text += "**MEASURDATA\r\n";
    for k in 0..40 {
        let angle = f64::from(k - 20) / 2.0;
        let numbers =
            [0.1 * f64::from(k), 60.0, 1.0, 10.0 * (angle - 0.5), 0.0, 0.05, -0.3 * angle, 4.0 * angle];
        text += &numbers.map(|it| format!("{it:>10.4}")).concat();
        text += "\r\n";
    }
    text + "**END\r\nafter the end\r\n"
}

#[test]
fn tydex_is_read_with_constants_factors_and_axes() {
    for axes in ["W", "H", "C", ""] {
        let text = tydex(axes, 3000.0);
        let found =
            read_bench_file(text.as_bytes(), "a.tdx", 0, &BenchReadOptions::default()).expect("samples");
        let BenchSample { time, kappa, alpha, F_z, pressure, v_x, F_x, F_y, M_z, .. } = found.samples[24];
        assert_eq!((found.samples.len(), F_z, F_x, M_z), (40, 3000.0, 50.0, 8.0));
        assert!((alpha - 2f64.to_radians()).abs() < 1e-12 && (F_y + 600.0).abs() < 1e-9, "{alpha} {F_y}");
        assert!((kappa - 0.01).abs() < 1e-15 && (pressure - 2.1e5).abs() < 1e-9);
        assert!((v_x - 60.0 / 3.6).abs() < 1e-12 && (time - 2.4).abs() < 1e-12);
    }
    // Each file is a sweep of one run.
    let texts = [2000.0, 4000.0].map(|load| tydex("W", load));
    let files = [("a", texts[0].as_bytes()), ("b", texts[1].as_bytes())];
    let all = read_bench_files(&files, &BenchReadOptions::default()).expect("samples");
    let last = all.samples.last().expect("a sample");
    assert_eq!((all.samples.len(), last.run, last.block, last.F_z), (80, 0, 1, 4000.0));
    assert!(all.notes[0].starts_with("a, b: no temperature"), "{:?}", all.notes);
}

#[test]
fn careless_tydex_is_read_as_well() {
    let sound = tydex("W", 3000.0);
    let expected =
        read_bench_file(sound.as_bytes(), "a", 0, &BenchReadOptions::default()).expect("samples").samples;
    let (head, data) = sound.split_once("**MEASURDATA").expect("data");
    let commas = format!("{head}**MEASURDATA{}", data.replace('.', ","));
    let lower: String = sound
        .lines()
        .map(|it| if it.starts_with("**") { it.to_lowercase() } else { it.to_owned() } + "\n")
        .collect();
    let no_end = sound.replace("**END\r\nafter the end\r\n", "");
    let start = sound.find("**CONSTANTS").expect("constants");
    let spaces = format!(
        "{head}**MEASURDATA{}",
        data.lines()
            .map(|it| it.split_whitespace().collect::<Vec<_>>().join("\t") + "\n")
            .collect::<String>()
    );
    let latin: Vec<u8> = sound.replace("all of it", "Größe").chars().map(|it| it as u32 as u8).collect();
    let wrapped = format!(
        "{head}**MEASURDATA{}",
        data.lines()
            .map(|it| {
                let (a, b) = it.split_at(it.len().min(40));
                format!("{a}\n{b}\n")
            })
            .collect::<String>()
    );
    let tabs: String = sound
        .lines()
        .map(|it| match it.starts_with(|c: char| c.is_ascii_uppercase()) && it.len() > 50 {
            true => {
                [it[..10].trim(), it[10..40].trim(), it[40..50].trim(), it[50..].trim()].join("\t") + "\n"
            }
            false => it.to_owned() + "\n",
        })
        .collect();
    let narrow: String = head
        .lines()
        .map(|it| {
            it.split("  ").filter(|it| !it.trim().is_empty()).map(str::trim).collect::<Vec<_>>().join(" ")
                + "\n"
        })
        .collect();
    let narrow = format!("{narrow}**MEASURDATA{data}").replace("a comment, FX 3 %", "a comment, FX 3 % 1");
    for (what, text) in [
        ("commas", commas.as_bytes()),
        ("lower", lower.as_bytes()),
        ("no end", no_end.as_bytes()),
        ("latin", &latin),
        ("no header", &sound.as_bytes()[start..]),
        ("spaces", spaces.as_bytes()),
        ("wrapped", wrapped.as_bytes()),
        ("tabs", tabs.as_bytes()),
        ("narrow", narrow.as_bytes()),
    ] {
        let found = read_bench_file(text, "a", 0, &BenchReadOptions::default())
            .unwrap_or_else(|bad| panic!("{what}: {bad}"));
        // As text, for a temperature that is not in the file is NaN, which equals nothing.
        assert_eq!(format!("{:?}", found.samples), format!("{expected:?}"), "{what}");
    }
}

#[test]
fn bad_tydex_is_refused_with_its_place() {
    let iso = BenchReadOptions::default();
    let sound = tydex("W", 3000.0);
    let cut = &sound[..sound.len() - 60];
    let error = refused(cut.as_bytes(), &iso);
    assert!(error.contains("expected 8 fields for each sample, found"), "{error}");
    let (head, _) = sound.split_once("**MEASURDATA").expect("data");
    assert!(refused(head.as_bytes(), &iso).contains("expected rows below **MEASURDATA, found none"));
    let error = refused(sound.replace("0.1       0         0.5", "x         0         0.5").as_bytes(), &iso);
    assert!(error.contains("SLIPANGL: expected a conversion factor or an offset, found `x`"), "{error}");
    let error = refused(sound.replace("0.1       0  ", "0         0  ").as_bytes(), &iso);
    assert!(error.contains("SLIPANGL: expected a conversion factor other than 0"), "{error}");
    let error = refused(b"**HEADER\n**MEASURDATA\n1 2 3\n", &iso);
    assert!(error.starts_with("a:3: expected **MEASURCHANNELS before **MEASURDATA"), "{error}");
    let many = sound.replace("**END", "1 2 3 4 5 6 7 8 9\n**END");
    assert!(refused(many.as_bytes(), &iso).contains("expected 8 fields, one for each channel, found 9"));
}
