//! Names the platforms that libraries are built for, as Rust and both versions of FMI do.

use std::path::PathBuf;

use super::FmiVersion;

/// The operating system and the processor that a library is built for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Platform {
    system: OperatingSystem,
    /// As FMI 3.0 calls it.
    architecture: &'static str,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum OperatingSystem {
    Linux,
    Windows,
    Darwin,
}

/// A library of an FMU.
#[derive(Debug, Clone)]
pub struct PlatformLibrary {
    /// Where it runs.
    pub platform: Platform,
    /// The file.
    pub path: PathBuf,
}

impl Platform {
    /// The platform of this program.
    #[must_use]
    pub const fn of_this_program() -> Self {
        let system = if cfg!(windows) {
            OperatingSystem::Windows
        } else if cfg!(target_os = "macos") {
            OperatingSystem::Darwin
        } else {
            OperatingSystem::Linux
        };
        // Rust and FMI 3.0 call the others the same.
        let architecture = if cfg!(target_arch = "arm") { "aarch32" } else { std::env::consts::ARCH };
        Platform { system, architecture }
    }

    /// The platform of a target of Rust, such as `x86_64-pc-windows-gnu`, if FMI has a name for it.
    #[must_use]
    pub fn of_target(triple: &str) -> Option<Self> {
        let mut words = triple.split('-');
        let architecture = match words.next()? {
            "x86_64" => "x86_64",
            "i586" | "i686" => "x86",
            "aarch64" => "aarch64",
            "riscv64gc" => "riscv64",
            word if word.starts_with("arm") => "aarch32",
            _ => return None,
        };
        let system = words.find_map(|word| match word {
            "linux" => Some(OperatingSystem::Linux),
            "windows" => Some(OperatingSystem::Windows),
            "darwin" => Some(OperatingSystem::Darwin),
            _ => None,
        })?;
        Some(Platform { system, architecture })
    }

    /// Whether it is Windows.
    #[must_use]
    pub fn is_windows(self) -> bool {
        self.system == OperatingSystem::Windows
    }

    /// The folder of its library inside an archive.
    #[must_use]
    pub fn archive_folder(self, version: FmiVersion) -> String {
        let (two, three) = match self.system {
            OperatingSystem::Linux => ("linux", "linux"),
            OperatingSystem::Windows => ("win", "windows"),
            OperatingSystem::Darwin => ("darwin", "darwin"),
        };
        // FMI 2.0 tells no processors apart, only the width of their addresses.
        let width = if self.architecture.ends_with("64") { 64 } else { 32 };
        match version {
            FmiVersion::Two => format!("binaries/{two}{width}"),
            FmiVersion::Three => format!("binaries/{}-{three}", self.architecture),
        }
    }

    /// The ending of the names of its dynamic libraries.
    #[must_use]
    pub const fn library_extension(self) -> &'static str {
        match self.system {
            OperatingSystem::Linux => "so",
            OperatingSystem::Windows => "dll",
            OperatingSystem::Darwin => "dylib",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn targets_have_the_folders_of_both_versions() {
        let folders = [
            ("x86_64-unknown-linux-gnu", "binaries/linux64", "binaries/x86_64-linux", "so"),
            ("i686-unknown-linux-gnu", "binaries/linux32", "binaries/x86-linux", "so"),
            ("aarch64-unknown-linux-gnu", "binaries/linux64", "binaries/aarch64-linux", "so"),
            ("x86_64-pc-windows-gnu", "binaries/win64", "binaries/x86_64-windows", "dll"),
            ("i686-pc-windows-msvc", "binaries/win32", "binaries/x86-windows", "dll"),
            ("aarch64-apple-darwin", "binaries/darwin64", "binaries/aarch64-darwin", "dylib"),
            ("armv7-unknown-linux-gnueabihf", "binaries/linux32", "binaries/aarch32-linux", "so"),
        ];
        for (triple, two, three, extension) in folders {
            let platform = Platform::of_target(triple).expect(triple);
            assert_eq!(platform.archive_folder(FmiVersion::Two), two);
            assert_eq!(platform.archive_folder(FmiVersion::Three), three);
            assert_eq!(platform.library_extension(), extension);
        }
        assert_eq!(Platform::of_this_program().library_extension(), std::env::consts::DLL_EXTENSION);
    }

    #[test]
    fn targets_without_a_name_in_fmi_have_no_platform() {
        for triple in ["", "windows", "x86_64-unknown-freebsd", "wasm32-unknown-unknown", "linux-x86_64"] {
            assert_eq!(Platform::of_target(triple), None, "{triple}");
        }
    }
}
