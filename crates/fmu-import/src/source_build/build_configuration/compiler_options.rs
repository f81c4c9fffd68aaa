//! Takes over the options of a compiler that an archive asks for, as far as they only say how its code is compiled.

/// Beginnings of options that make code. Others may write files, load code into the compiler, or read what is none of the archive's.
const ALLOWED: [&str; 9] = ["-D", "-U", "-O", "-W", "-f", "-m", "-std=", "-g", "-pthread"];
/// Beginnings among these that do one of that, or make code for this machine alone, which other ones would not repeat to the bit.
const FORBIDDEN: [&str; 19] = [
    "-Wl,",
    "-Wa,",
    "-Wp,",
    "-fplugin",
    "-fdump",
    "-fprofile",
    "-ftest-coverage",
    "-fsave",
    "-fopt-info",
    "-fcallgraph",
    "-fstack-usage",
    "-fdiagnostics",
    "-fuse-ld",
    "-fmodule",
    "-fcompare-debug",
    "-fsanitize",
    "-fembed",
    "-march=native",
    "-mtune=native",
];

/// Whether a compiler takes the options of GCC, by the name that a build description gives it.
pub(super) fn is_known_compiler(name: &str) -> bool {
    let name = name.to_lowercase();
    name.is_empty() || ["gcc", "g++", "clang", "gnu", "cc"].iter().any(|known| name.contains(known))
}

/// The options that are taken over. The others are told.
pub(super) fn filter_options(asked: &str, notes: &mut Vec<String>) -> Vec<String> {
    let begins = |word: &str, list: &[&str]| list.iter().any(|begin| word.starts_with(begin));
    let (taken, left): (Vec<_>, Vec<_>) =
        asked.split_whitespace().partition(|word| begins(word, &ALLOWED) && !begins(word, &FORBIDDEN));
    notes.extend(left.iter().map(|word| format!("its compiler option `{word}` is left out")));
    taken.into_iter().map(str::to_owned).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_option_that_reaches_beyond_the_code_is_left_out() {
        let mut notes = Vec::new();
        let asked = "-fno-rtti -fplugin=./x.so -o /home/x -DA=1 @file -Wl,-z,now -march=native -B/tmp";
        assert_eq!(filter_options(asked, &mut notes), ["-fno-rtti", "-DA=1"]);
        assert_eq!(notes.len(), 7, "{notes:?}");
        assert!(is_known_compiler("clang++") && !is_known_compiler("VisualC"));
    }
}
