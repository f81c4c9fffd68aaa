//! Messages about types of connections, start values and conversions.

use super::fmus;
use super::lab::{Lab, Mistake, check_mistakes};

/// A scenario with values of all types.
const GOOD: &str = r#"title = "Types"

[time]
step = 0.01
stop = 0.1

[[signal]]
name = "driver.v"
constant = 1

[[fmu]]
name = "a"
path = "relay.fmu"
start = { x = 0.0, n = 0, on = false, text = "", mode = "off", gear = "drive" }

[[fmu]]
name = "b"
path = "relay.fmu"
start = { gear = 1, x = 0.0, n = 0, mode = 1, on = false }

[[fmu]]
name = "c"
path = "relay.fmu"
start = { text = "", n = 0, on = true, mode = 2, gear = 1 }

[[connect]]
from = "driver.v"
to = "c.x"

[[connect]]
from = "a.text_out"
to = "b.text"
"#;

/// An end of the scenario that connects other types.
const A_TO_B: &str = "from = \"a.text_out\"\nto = \"b.text\"\n";

#[rustfmt::skip]
const MISTAKES: &[Mistake] = &[
    // Types that become each other only when asked for.
    (A_TO_B, "from = \"a.on_out\"\nto = \"b.n\"\n", "b.n", &["`a.on_out` to `b.n`: Boolean does not fit Integer", "`convert = \"boolean_to_integer\"`"]),
    (A_TO_B, "from = \"a.n_out\"\nto = \"b.on\"\n", "b.on", &["Integer does not fit Boolean", "`convert = \"integer_to_boolean\"`"]),
    (A_TO_B, "from = \"a.n_out\"\nto = \"b.x\"\n", "b.x", &["Integer does not fit Real", "`convert = \"integer_to_real\"`"]),
    (A_TO_B, "from = \"a.n_out\"\nto = \"b.mode\"\n", "b.mode", &["Integer does not fit Enumeration", "`convert = \"integer_to_enumeration\"`"]),
    (A_TO_B, "from = \"a.mode_out\"\nto = \"b.n\"\n", "b.n", &["Enumeration does not fit Integer", "`convert = \"enumeration_to_integer\"`"]),
    // Types that never do.
    (A_TO_B, "from = \"a.x_out\"\nto = \"b.n\"\n", "b.n", &["`a.x_out` to `b.n`: Real does not fit Integer", "no `convert` makes Real into Integer"]),
    (A_TO_B, "from = \"a.x_out\"\nto = \"b.on\"\n", "b.on", &["Real does not fit Boolean"]),
    (A_TO_B, "from = \"a.x_out\"\nto = \"b.mode\"\n", "b.mode", &["Real does not fit Enumeration"]),
    (A_TO_B, "from = \"a.x_out\"\nto = \"b.text\"\n", "b.text", &["Real does not fit String"]),
    (A_TO_B, "from = \"a.on_out\"\nto = \"b.x\"\n", "b.x", &["Boolean does not fit Real"]),
    (A_TO_B, "from = \"a.mode_out\"\nto = \"b.on\"\n", "b.on", &["Enumeration does not fit Boolean"]),
    (A_TO_B, "from = \"a.text_out\"\nto = \"b.x\"\n", "b.x", &["String does not fit Real"]),
    (A_TO_B, "from = \"a.text_out\"\nto = \"b.n\"\nconvert = \"boolean_to_integer\"\n", "b.n", &["String does not fit Integer"]),
    (A_TO_B, "from = \"driver.v\"\nto = \"b.text\"\n", "b.text", &["Real does not fit String"]),
    (A_TO_B, "from = \"a.mode_out\"\nto = \"b.gear\"\n", "b.gear", &["the enumerations differ", "one has off = 1, armed = 2, tripped = 4, the other reverse = -1, drive = 1"]),
    // The key itself.
    ("b.text\"\n", "b.text\"\nconvert = \"boolean_to_integer\"\n", "convert", &["there is no type to convert", "leave `convert` out"]),
    ("c.x\"\n", "c.x\"\nconvert = \"integer_to_real\"\n", "convert", &["there is no type to convert"]),
    (A_TO_B, "from = \"a.on_out\"\nto = \"b.n\"\nconvert = \"integer_to_boolean\"\n", "convert", &["Boolean to Integer is another conversion", "`convert = \"boolean_to_integer\"`"]),
    ("b.text\"\n", "b.text\"\nconvert = \"bool_to_integer\"\n", "convert", &["unknown value `bool_to_integer`", "did you mean `boolean_to_integer`?"]),
    // Texts have no numbers.
    ("b.text\"\n", "b.text\"\nnoise = { std = 0.1 }\n", "noise", &["`a.text_out` to `b.text` carries texts", "`noise`"]),
    ("b.text\"\n", "b.text\"\ngain = 2.0\n", "gain", &["carries texts", "`gain`"]),
    ("b.text\"\n", "b.text\"\ndelay = 0.1\n", "delay", &["carries texts", "`delay`"]),
    ("b.text\"\n", "b.text\"\n[[fault]]\ninput = \"b.text\"\nfrom = 0.0\nfreeze = true\n", "input =", &["`b.text` is a text", "faults"]),
    ("b.text\"\n", "b.text\"\n[[view.plot]]\ntitle = \"t\"\nsignals = [{ signal = \"a.text_out\" }]\n", "signals =", &["`a.text_out` is a text"]),
    ("b.text\"\n", "b.text\"\n[[check]]\nname = \"t\"\nthat = \"b.text_out < 'on'\"\n", "that =", &["`==` and `!=` only"]),
    // Start values.
    (", text = \"\"", "", "\"a\"", &["nothing is connected to `text` of `a`", "start = { \"text\" = \"\" }"]),
    (", mode = \"off\"", "", "\"a\"", &["nothing is connected to `mode`", "start = { \"mode\" = \"off\" }"]),
    ("mode = \"off\"", "mode = \"of\"", "mode = \"of\"", &["`mode` is an Enumeration", "off = 1, armed = 2, tripped = 4", "found \"of\""]),
    ("mode = \"off\"", "mode = 3", "mode = 3", &["`mode` is an Enumeration", "found 3"]),
    ("mode = \"off\"", "mode = true", "mode = true", &["`mode` is an Enumeration", "found true"]),
    ("on = false", "on = 0", "on = 0", &["`on` is Boolean, found integer 0"]),
    ("text = \"\"", "text = 5", "text = 5", &["`text` is String, found integer 5"]),
    ("text = \"\"", "text = \"a\\u0000b\"", "text = \"a", &["NUL"]),
];

#[test]
fn each_mistake_of_types_is_told_at_its_line() {
    let lab = Lab::new();
    lab.fmu("relay.fmu", fmus::RELAY);
    check_mistakes(&lab, GOOD, MISTAKES);
}
