//! Tries in a test what was hard to read once, and some new cases.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use crate::crew::panic_message;
use crate::{FuzzTarget, make_damaged_input};

/// Tries all sound inputs, which must be taken; all of the corpus; and the cases of so many seeds, of which some must be taken.
///
/// # Panics
/// When a case panics, with its name; when a sound input is refused; when there is no folder of the corpus.
pub fn replay_corpus(target: &FuzzTarget, count: u64) {
    let folder = tempfile::tempdir().expect("a folder");
    let attempt = |bytes: &[u8], name: &str| -> bool {
        let tried = catch_unwind(AssertUnwindSafe(|| (target.attempt)(bytes, folder.path())));
        tried.unwrap_or_else(|panic| panic!("{} {name}: {}", target.name, panic_message(&*panic)))
    };
    let sound = (target.sound)();
    for (place, bytes) in sound.iter().enumerate() {
        assert!(attempt(bytes, "as it should be"), "sound {} {place} is refused", target.name);
    }
    let mut files: Vec<PathBuf> = match std::fs::read_dir(Path::new(target.corpus)) {
        Ok(files) => files.map(|file| file.expect("a file").path()).collect(),
        Err(error) => panic!("cannot read the corpus {}: {error}", target.corpus),
    };
    files.sort();
    for path in files {
        let bytes = std::fs::read(&path).expect("a file of the corpus");
        attempt(&bytes, &path.display().to_string());
    }
    let taken =
        (0..count).filter(|seed| attempt(&make_damaged_input(target, &sound, *seed), &seed.to_string()));
    let taken = taken.count() as u64;
    assert!(taken > count / 1000, "{}: {taken} of {count} are taken", target.name);
}
