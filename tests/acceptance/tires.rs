//! Looks at tire files by `trackside tire`, and drives on them.

use super::harness::Lab;

tests! {
    a_tire_has_key_figures_and_a_page: Compiler,
    two_tires_are_compared_and_one_is_written_anew: Compiler,
    one_line_says_whether_a_tire_is_plausible: Compiler,
    wrong_files_are_told_with_line_and_key: Compiler,
    hostile_texts_of_a_file_do_not_reach_terminal_and_page: Compiler,
}

fn sports(lab: &Lab) -> String {
    let text = tire_file::write_tir_text(&tire::Coefficients::sports_tire(), &[]);
    lab.write("sports.tir", &text);
    text
}

fn a_tire_has_key_figures_and_a_page() {
    let lab = Lab::new();
    sports(&lab);
    let ended = lab.trackside(&["tire", "sports.tir", "--out", "pages"]).expect(0);
    for line in [
        "sports.tir, MF 6.2",
        "lateral peak friction                            1.100",
        "slip stiffness                                   92.00 kN",
        "pages/sports.html",
    ] {
        assert!(ended.stdout.contains(line), "{line} in {}", ended.stdout);
    }
    let page = std::fs::read_to_string(lab.path("pages/sports.html")).expect("a page");
    for title in
        ["Friction ellipse at nominal load", "Aligning moment over slip angle", "by camber", "by pressure"]
    {
        assert!(page.contains(title), "{title}");
    }
    assert_eq!(page.matches("<figure>").count(), 9);
    assert!(!page.contains("NaN"));
}

fn two_tires_are_compared_and_one_is_written_anew() {
    let lab = Lab::new();
    let text = sports(&lab);
    lab.write(
        "sae.tir",
        text.replace("PKY6                     = -0.95", "PKY6 = 0.95")
            .replace("QDZ8                     = -0.12", "QDZ8 = 0.12"),
    );
    let ended = lab.trackside(&["tire", "sae.tir", "sports.tir"]).expect(0);
    ended.says(&["speak for SAE axes", "--axes"]);
    lab.trackside(&["tire", "sae.tir", "--axes", "sae", "--write", "iso.tir"]).expect(0);
    let written = std::fs::read_to_string(lab.path("iso.tir")).expect("a tire");
    let (tire, _) = tire_file::read_tir(&written, "iso.tir").expect("a tire");
    assert_eq!((tire.PKY6, tire.QDZ8, tire.PKY1), (-0.95, -0.12, -21.0));
}

fn one_line_says_whether_a_tire_is_plausible() {
    let lab = Lab::new();
    let text = sports(&lab);
    lab.trackside(&["tire", "sports.tir"]).expect(0).says(&[
        "note: sports.tir: MF 6.2: lateral friction 1.100 and 70.28 kN/rad",
        "driving 1.180",
        "230 kPa",
    ]);
    lab.write("odd.tir", text.replace("PDY1                     = 1.1", "PDY1 = 133"));
    lab.trackside(&["tire", "odd.tir"])
        .expect(0)
        .says(&["warning: odd.tir: MF 6.2:", "Not plausible: lateral friction is"]);
    let without_unit = text
        .replace("PRESSURE = 'pascal'\n", "")
        .replace("INFLPRES                 = 230000", "INFLPRES = 2.3")
        .replace("NOMPRES                  = 230000", "NOMPRES = 2.3");
    lab.write("bar.tir", without_unit);
    lab.trackside(&["tire", "bar.tir"])
        .expect(0)
        .says(&["warning: bar.tir: INFLPRES = 2.3 and NOMPRES = 2.3", "say PRESSURE = 'bar'"])
        .says(&["lateral friction 1.100"]);
}

fn wrong_files_are_told_with_line_and_key() {
    let lab = Lab::new();
    let text = sports(&lab);
    lab.write("bad.tir", text.replace("PKY1                     = -21", "PKY1 = soft"));
    lab.trackside(&["tire", "bad.tir"])
        .expect(2)
        .says(&["bad.tir is no tire", "PKY1: expected a number, found `soft"]);
    lab.write("light.tir", text.replace("FNOMIN                   = 4000", "FNOMIN = -4"));
    lab.trackside(&["tire", "light.tir"]).expect(2).says(&["FNOMIN is -4, expected a number above 0"]);
    lab.trackside(&["tire", "none.tir"]).expect(2).says(&["the tire none.tir cannot be read"]);
    lab.write("empty.tir", "");
    lab.trackside(&["tire", "empty.tir"]).expect(2).says(&["expected the text of a tire property file"]);
    lab.write("mc.tir", "[MODEL]\nPROPERTY_FILE_FORMAT = 'PAC_MC'\n");
    lab.trackside(&["tire", "mc.tir"]).expect(2).says(&["mc.tir:2", "motorcycle"]);
}

fn hostile_texts_of_a_file_do_not_reach_terminal_and_page() {
    let lab = Lab::new();
    let text = sports(&lab);
    lab.write("odd.tir", format!("{text}[X]\nA\u{1b}[31m<script> = 3\n"));
    let ended = lab.trackside(&["tire", "odd.tir", "--out", "pages"]).expect(0);
    assert!(ended.stderr.contains("no part of the formula, and kept"), "{}", ended.stderr);
    assert!(!ended.stderr.contains('\u{1b}'), "{}", ended.stderr);
    let page = std::fs::read_to_string(lab.path("pages/odd.html")).expect("a page");
    assert!(!page.contains("<SCRIPT>") && !page.contains('\u{1b}'));
}
