//! Compares what libraries are loaded with, and reads damaged ones.

use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;

use super::*;

fn linkage(bundled: &[&str], needed: &[&str], unique: &[(&str, Option<&[u8]>)]) -> LibraryLinkage {
    let names = |names: &[&str]| names.iter().map(ToString::to_string).collect();
    let unique = unique.iter().map(|(name, bytes)| ((*name).to_owned(), bytes.map(<[u8]>::to_vec)));
    LibraryLinkage {
        bundled: names(bundled),
        needed: names(needed),
        unique: unique.collect(),
        ..LibraryLinkage::default()
    }
}

#[test]
fn a_name_that_one_brings_and_both_need_is_a_clash() {
    let one = linkage(&["librt.so"], &["librt.so", "libstdc++.so.6"], &[]);
    let other = linkage(&[], &["librt.so", "libstdc++.so.6"], &[]);
    let clash = Some(LibraryClash::Library("librt.so".to_owned()));
    assert_eq!((one.clash_with(&other), other.clash_with(&one)), (clash.clone(), clash));
    let system = linkage(&["libown.so"], &["libstdc++.so.6"], &[]);
    assert_eq!((one.clash_with(&system), system.clash_with(&one)), (None, None));
}

#[test]
fn a_symbol_of_both_is_a_clash_unless_it_is_the_same_constant() {
    let of = |bytes| linkage(&[], &[], &[("gain", bytes), ("own", None)][..1]);
    let clash = Some(LibraryClash::Symbol("gain".to_owned()));
    assert_eq!(of(Some(b"3")).clash_with(&of(Some(b"3"))), None);
    assert_eq!(of(Some(b"3")).clash_with(&of(Some(b"4"))), clash);
    assert_eq!(of(None).clash_with(&of(None)), clash);
    assert_eq!(of(None).clash_with(&linkage(&[], &[], &[("other", None)])), None);
}

#[test]
#[cfg_attr(miri, ignore = "it reads libraries of the system")]
fn damaged_libraries_are_read_or_left() {
    let Some(path) =
        system::find_system_library("libgcc_s.so.1").or_else(|| system::find_system_library("libm.so.6"))
    else {
        return;
    };
    assert!(ElfLinkInfo::read(&path).is_some_and(|object| object.soname.is_some()));
    let sound = std::fs::read(path).expect("a library");
    let file = tempfile::NamedTempFile::new().expect("a file");
    let mut random = Pcg64::seed_from_u64(1);
    for _ in 0..300 {
        let mut bytes = sound.clone();
        for _ in 0..random.random_range(1..20) {
            // The tables are at the beginning and at the end.
            let near = random.random_range(0..2_000.min(bytes.len()));
            let place = if random.random() { near } else { bytes.len() - 1 - near };
            bytes[place] = random.random();
        }
        bytes.truncate(random.random_range(1..=bytes.len() * 4).min(bytes.len()));
        std::fs::write(file.path(), &bytes).expect("a file");
        let _ = ElfLinkInfo::read(file.path());
    }
}
