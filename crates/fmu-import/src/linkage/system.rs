//! Finds a library of the system as the loader of glibc does (ld.so(8)).

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use super::elf::ElfLinkInfo;

/// Where libraries of the system are in any case.
const FOLDERS: [&str; 4] = ["/lib64", "/usr/lib64", "/lib", "/usr/lib"];

/// The names of the libraries of the system that this process has before any FMU: whoever needs one of them gets it.
pub(super) static PROGRAM: LazyLock<BTreeSet<String>> = LazyLock::new(|| {
    let maps = std::fs::read_to_string("/proc/self/maps").unwrap_or_default();
    // Addresses, permissions, offset, device, inode, path (proc_pid_maps(5)).
    let paths = maps.lines().filter_map(|line| line.find('/').map(|at| Path::new(&line[at..])));
    let paths: BTreeSet<_> =
        paths.filter(|path| FOLDERS.iter().any(|folder| path.starts_with(folder))).collect();
    paths.into_iter().filter_map(|path| ElfLinkInfo::read(path)?.soname).collect()
});

/// The folders of `LD_LIBRARY_PATH`.
pub(super) fn library_path_folders() -> Vec<PathBuf> {
    let folders = std::env::var_os("LD_LIBRARY_PATH").unwrap_or_default();
    std::env::split_paths(&folders).filter(|path| !path.as_os_str().is_empty()).collect()
}

/// The library of the system with a name.
pub(super) fn find_system_library(name: &str) -> Option<PathBuf> {
    let cached = CACHE.get(name).into_iter().flatten().cloned();
    let others = FOLDERS.iter().map(|folder| Path::new(folder).join(name));
    cached.chain(others).find(|path| ElfLinkInfo::read(path).is_some())
}

/// The paths in `/etc/ld.so.cache`, by name: those of other machines, too.
static CACHE: LazyLock<BTreeMap<String, Vec<PathBuf>>> = LazyLock::new(|| {
    let bytes = std::fs::read("/etc/ld.so.cache").unwrap_or_default();
    parse_loader_cache(&bytes).unwrap_or_default()
});

/// Reads the cache: `struct cache_file_new` of glibc's sysdeps/generic/dl-cache.h.
fn parse_loader_cache(bytes: &[u8]) -> Option<BTreeMap<String, Vec<PathBuf>>> {
    const MAGIC: &[u8] = b"glibc-ld.so.cache1.1";
    const HEADER: usize = 48;
    const ENTRY: usize = 24;
    // An older form may come first.
    let begin = bytes.windows(MAGIC.len()).position(|window| window == MAGIC)?;
    let bytes = bytes.get(begin..)?;
    let number = |at: usize| -> Option<usize> {
        let field = bytes.get(at..at + 4)?.try_into().ok()?;
        usize::try_from(u32::from_ne_bytes(field)).ok()
    };
    let text = |at: usize| -> Option<String> {
        let rest = bytes.get(at..)?;
        let end = rest.iter().position(|byte| *byte == 0)?;
        Some(String::from_utf8_lossy(&rest[..end]).into_owned())
    };
    let mut found: BTreeMap<String, Vec<PathBuf>> = BTreeMap::new();
    for entry in 0..number(MAGIC.len())? {
        let at = HEADER + ENTRY * entry;
        let (name, path) = (text(number(at + 4)?)?, text(number(at + 8)?)?);
        found.entry(name).or_default().push(path.into());
    }
    Some(found)
}

#[cfg(all(test, target_os = "linux", target_env = "gnu"))]
mod tests {
    use super::*;

    #[test]
    fn the_library_of_c_is_one_of_the_program_and_is_found() {
        assert!(PROGRAM.contains("libc.so.6"), "{:?}", *PROGRAM);
        assert!(find_system_library("libc.so.6").is_some_and(|path| path.is_file()));
        assert_eq!(find_system_library("libof_nobody.so.7"), None);
    }

    #[test]
    fn a_broken_cache_is_none() {
        assert_eq!(parse_loader_cache(b""), None);
        let mut bytes = b"glibc-ld.so.cache1.1".to_vec();
        bytes.extend(u32::MAX.to_ne_bytes());
        assert_eq!(parse_loader_cache(&bytes), None);
    }
}
