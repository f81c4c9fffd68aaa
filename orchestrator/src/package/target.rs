//! The targets of Rust that libraries are built for beside this machine, and what a machine lacks to build for one.

use fmu_export::pack::{FmiVersion, Platform};
use fmu_import::find_program;

use super::error::BuildError;

/// The target that this program was built for.
const THIS_MACHINE: &str = env!("BUILD_TARGET");

/// Why no FMU can be built for a target.
pub(super) const NO_DYNAMIC_LIBRARIES: &str = "the target has no dynamic libraries";

/// A target of Rust whose libraries have a folder of their own in an archive.
#[derive(Debug, Clone)]
pub struct BuildTarget {
    /// As rustc calls it, e.g. `x86_64-pc-windows-gnu`.
    pub triple: String,
    /// As FMI calls it.
    pub platform: Platform,
}

impl BuildTarget {
    /// The targets of archives of one version, without that of this machine, whose library is in each archive.
    ///
    /// # Errors
    /// When FMI has no name for a target, or two of them would have the same folder.
    pub fn from_triples(triples: &[String], version: FmiVersion) -> Result<Vec<Self>, BuildError> {
        let own = BuildTarget { triple: THIS_MACHINE.to_owned(), platform: Platform::of_this_program() };
        let mut targets = vec![own];
        for triple in triples {
            if targets.iter().any(|known| known.triple == *triple) {
                continue;
            }
            let unknown = || BuildError::UnknownPlatform { target: triple.clone() };
            let platform = Platform::of_target(triple).ok_or_else(unknown)?;
            let folder = platform.archive_folder(version);
            if let Some(other) = targets.iter().find(|known| known.platform.archive_folder(version) == folder)
            {
                let other = other.triple.clone();
                return Err(BuildError::SameFolder { target: triple.clone(), other, folder });
            }
            targets.push(BuildTarget { triple: triple.clone(), platform });
        }
        targets.remove(0);
        Ok(targets)
    }

    /// What has to be installed, if that is why cargo failed with these messages.
    pub(super) fn missing_tools(&self, messages: &str) -> Option<String> {
        let triple = &self.triple;
        if messages.contains("could not find specification for target") {
            return Some("rustc knows no such target: `rustc --print target-list` lists them".to_owned());
        }
        if messages.contains("does not support these crate types") {
            return Some(NO_DYNAMIC_LIBRARIES.to_owned());
        }
        let refused = quoted_word(messages, "linker `", "` not found");
        if messages.contains("can't find crate for `") && messages.contains("target may not be installed") {
            let library = format!(
                "Rust's standard library for this target is not installed (`rustup target add {triple}`)"
            );
            let linker = refused.or_else(|| self.usual_linker().filter(|name| find_program(name).is_none()));
            let linker = linker.map(|name| format!(", nor is its linker {name}{}", debian_package(name)));
            return Some(library + &linker.unwrap_or_default());
        }
        refused.map(|name| format!("its linker {name} is not installed{}", debian_package(name)))
    }

    /// The linker that rustc calls when no configuration of cargo names one, where that is not `cc`.
    fn usual_linker(&self) -> Option<&'static str> {
        match self.triple.as_str() {
            "x86_64-pc-windows-gnu" => Some("x86_64-w64-mingw32-gcc"),
            "i686-pc-windows-gnu" => Some("i686-w64-mingw32-gcc"),
            _ => None,
        }
    }
}

/// How to install a linker on Debian and its relatives, where the package has another name.
fn debian_package(linker: &str) -> String {
    let package = match linker {
        "x86_64-w64-mingw32-gcc" => "gcc-mingw-w64-x86-64",
        "i686-w64-mingw32-gcc" => "gcc-mingw-w64-i686",
        _ => return String::new(),
    };
    format!(" (Debian: `apt-get install {package}`)")
}

/// The word between two others.
fn quoted_word<'a>(text: &'a str, before: &str, after: &str) -> Option<&'a str> {
    let (_, rest) = text.split_once(before)?;
    rest.split_once(after).map(|(word, _)| word).filter(|word| !word.contains(char::is_whitespace))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn targets(triples: &[&str], version: FmiVersion) -> Result<Vec<String>, String> {
        let triples: Vec<_> = triples.iter().map(|triple| (*triple).to_owned()).collect();
        let targets = BuildTarget::from_triples(&triples, version).map_err(|error| error.to_string())?;
        Ok(targets.into_iter().map(|target| target.triple).collect())
    }

    #[test]
    fn each_target_is_built_once_and_that_of_this_machine_not_again() {
        let windows = "x86_64-pc-windows-gnu";
        let all = targets(&[windows, THIS_MACHINE, windows], FmiVersion::Two);
        assert_eq!(all, Ok(vec![windows.to_owned()]));
    }

    #[test]
    fn targets_of_one_folder_are_refused() {
        let two = ["x86_64-pc-windows-gnu", "x86_64-pc-windows-msvc"];
        let error = targets(&two, FmiVersion::Three).expect_err("one folder");
        assert!(error.contains("binaries/x86_64-windows"), "{error}");
        // Only FMI 3.0 tells processors of one width apart.
        let two = ["i686-unknown-linux-gnu", "armv7-unknown-linux-gnueabihf"];
        assert!(targets(&two, FmiVersion::Two).is_err_and(|error| error.contains("binaries/linux32")));
        assert_eq!(targets(&two, FmiVersion::Three).map(|all| all.len()), Ok(2));
    }

    #[test]
    fn a_target_without_a_name_in_fmi_is_refused() {
        let error = targets(&["wasm32-unknown-unknown"], FmiVersion::Two).expect_err("no library there");
        assert!(error.contains("wasm32-unknown-unknown"), "{error}");
    }

    fn missing(triple: &str, messages: &str) -> Option<String> {
        let platform = Platform::of_target(triple).expect("a platform");
        BuildTarget { triple: triple.to_owned(), platform }.missing_tools(messages)
    }

    #[test]
    fn what_has_to_be_installed_is_told() {
        let library = "error[E0463]: can't find crate for `core`\n  = note: the `x86_64-apple-darwin` target may not be installed\n";
        let told = missing("x86_64-apple-darwin", library).expect("a library");
        assert!(told.ends_with("(`rustup target add x86_64-apple-darwin`)"), "{told}");
        let linker = "error: linker `x86_64-w64-mingw32-gcc` not found\n  |\n  = note: No such file or directory (os error 2)\n";
        assert_eq!(
            missing("x86_64-pc-windows-gnu", linker).as_deref(),
            Some(
                "its linker x86_64-w64-mingw32-gcc is not installed (Debian: `apt-get install gcc-mingw-w64-x86-64`)"
            )
        );
        let both = missing("x86_64-pc-windows-gnu", &(library.to_owned() + linker)).expect("both");
        assert!(both.contains("rustup target add") && both.contains("nor is its linker x86_64"), "{both}");
        let unknown = "error: error loading target specification: could not find specification for target \"x86_64-pc-windows\"";
        assert!(missing("x86_64-pc-windows-gnuu", unknown).is_some_and(|told| told.contains("target-list")));
        assert_eq!(missing("x86_64-pc-windows-gnu", "error[E0308]: mismatched types"), None);
    }
}
