//! Gives the program files without an end, or with a hole larger than the memory.

use super::fixture::Scenario;
use super::harness::Lab;

tests! {
    inputs_larger_than_their_limits_are_refused,
}

/// Five gigabytes of zeros that take no room on the disk, and zeros without an end.
fn inputs_larger_than_their_limits_are_refused() {
    let lab = Lab::new();
    for (name, found) in [("hole", "found 5368709120"), ("endless", "a file on a disk")] {
        for ending in ["toml", "csv", "mcap", "fmu", "ssp"] {
            let path = lab.path(&format!("{name}.{ending}"));
            match name {
                "hole" => std::fs::File::create(path).and_then(|it| it.set_len(5 << 30)),
                _ => std::os::unix::fs::symlink("/dev/zero", path),
            }
            .expect("a file");
        }
        let scenario = |text: Scenario| lab.write("case.toml", text.time(0.01, 1.0).text());
        let text = if name == "hole" { found } else { "found more" };
        lab.trackside(&["run", &format!("{name}.toml")]).expect(2).says(&[text, ".toml"]);
        for archive in ["fmu", "ssp"] {
            let words = [if archive == "fmu" { "inspect" } else { "run" }, &format!("{name}.{archive}")];
            lab.trackside(&words).expect(2).says(&[found, archive]);
        }
        scenario(Scenario::new().fmu("a", &format!("{name}.fmu"), ""));
        lab.trackside(&["run", "case.toml"]).expect(2).says(&[found, ".fmu"]);
        for table in ["csv", "mcap"] {
            scenario(Scenario::new().table("a", &format!("{name}.{table}"), "x = { column = \"x\" }"));
            // A table may have any size, and its beginning tells that zeros are none; what has no end is not on a disk.
            let text = if name == "hole" { "is no text" } else { text };
            lab.trackside(&["run", "case.toml"]).expect(2).says(&[text, table]);
        }
    }
    let into = ["recover", "endless.mcap", "--out", "new.mcap"];
    lab.trackside(&into).expect(2).says(&["endless.mcap", "a file on a disk"]);
    assert!(!lab.has("new.mcap") && !lab.has("new.mcap.partial"));
}
