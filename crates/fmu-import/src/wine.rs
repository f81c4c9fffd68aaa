//! Finds what runs an FMU's library for Windows on Linux: Wine, its prefix, and the program that loads the library there.
//!
//! The prefix and a program that had to be compiled lie in the user's cache folder.

mod imports;
mod prefix;
mod program;

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Arc;

use self::prefix::SessionPrefix;
use crate::file_list::list_files;
use crate::program_search::find_program;
use crate::{FmiVersion, FmuDescription};

/// How wide the addresses of a library are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum WindowsBits {
    Bits32,
    Bits64,
}

impl WindowsBits {
    /// The folders of libraries in an archive, by the version of FMI.
    const fn folder(self, version: FmiVersion) -> &'static str {
        match (self, version) {
            (WindowsBits::Bits64, FmiVersion::One | FmiVersion::Two) => "win64",
            (WindowsBits::Bits64, FmiVersion::Three) => "x86_64-windows",
            (WindowsBits::Bits32, FmiVersion::One | FmiVersion::Two) => "win32",
            (WindowsBits::Bits32, FmiVersion::Three) => "x86-windows",
        }
    }

    /// That of the library at a path, by the folder that it is in.
    pub fn of_library(path: &Path) -> Self {
        let folder = path.parent().and_then(Path::file_name);
        match folder.is_some_and(|it| it == "win32" || it == "x86-windows") {
            true => WindowsBits::Bits32,
            false => WindowsBits::Bits64,
        }
    }

    /// Bytes of a pointer.
    pub const fn pointer_width(self) -> usize {
        match self {
            WindowsBits::Bits32 => 4,
            WindowsBits::Bits64 => 8,
        }
    }

    /// What names of programs and folders call the processor.
    const fn processor(self) -> &'static str {
        match self {
            WindowsBits::Bits32 => "i686",
            WindowsBits::Bits64 => "x86_64",
        }
    }
}

/// The library for Windows that an unpacked archive has, that of 64 bits first. Windows does not tell capital letters from small ones.
/// The program that loads it knows the functions of FMI 2.0 and 3.0.
pub(crate) fn windows_library(root: &Path, about: &FmuDescription) -> Option<PathBuf> {
    if about.version == FmiVersion::One {
        return None;
    }
    [WindowsBits::Bits64, WindowsBits::Bits32].into_iter().find_map(|bits| {
        let all = list_files(root, &format!("binaries/{}", bits.folder(about.version)), &["dll", "DLL"]);
        let is_own = |path: &&String| {
            let stem = Path::new(path).file_stem().and_then(|stem| stem.to_str());
            stem.is_some_and(|stem| stem.eq_ignore_ascii_case(&about.identifier))
        };
        let only = all.first().filter(|_| all.len() == 1);
        all.iter().find(is_own).or(only).map(|path| root.join(path))
    })
}

/// Whether the library at `path` runs through Wine.
pub(crate) fn is_windows_library(path: &Path) -> bool {
    path.extension().is_some_and(|it| it.eq_ignore_ascii_case("dll"))
}

/// A path as programs under Wine name it.
pub(crate) fn windows_path(path: &Path) -> String {
    format!("Z:{}", path.display().to_string().replace('/', "\\"))
}

/// Why a library for Windows does not run here, and what to install; nothing is started.
///
/// # Errors
/// In a sentence.
pub(crate) fn check_wine(library: &Path) -> Result<(), String> {
    let bits = WindowsBits::of_library(library);
    let lacks = [
        (find_wine(bits).is_none()).then_some(match bits {
            WindowsBits::Bits64 => "wine64",
            WindowsBits::Bits32 => "wine32:i386",
        }),
        (!program::is_available(bits)).then_some(match bits {
            WindowsBits::Bits64 => "gcc-mingw-w64-x86-64",
            WindowsBits::Bits32 => "gcc-mingw-w64-i686",
        }),
    ];
    let lacks: Vec<_> = lacks.into_iter().flatten().collect();
    if lacks.is_empty() {
        return Ok(());
    }
    let first = match bits {
        WindowsBits::Bits32 if find_wine(bits).is_none() => "dpkg --add-architecture i386 && apt update && ",
        _ => "",
    };
    let folder = library.parent().and_then(Path::file_name).unwrap_or_default().display();
    Err(format!(
        "the library for {folder} runs through Wine, for which this system lacks {}: `{first}apt install {}` on Debian",
        lacks.join(" and "),
        lacks.join(" ")
    ))
}

/// What to start for a library for Windows.
#[derive(Debug)]
pub(crate) struct WineSetup {
    pub bits: WindowsBits,
    /// The program for Windows that loads the library.
    pub host: PathBuf,
    wine: PathBuf,
    prefix: Arc<SessionPrefix>,
}

impl WineSetup {
    /// Finds or makes all of it.
    ///
    /// # Errors
    /// In a sentence.
    pub fn prepare(bits: WindowsBits) -> Result<Self, String> {
        let wine = find_wine(bits).ok_or("Wine is not there")?;
        let host = program::find_or_compile(bits)?;
        let prefix = SessionPrefix::of_process(&wine)?;
        Ok(WineSetup { bits, host, wine, prefix })
    }

    /// Wine, to which arguments are added.
    pub fn command(&self) -> Command {
        // Without services: their start takes seconds, and they would go on after the run.
        wine_command(&self.wine, self.prefix.path(), "wineboot.exe,winemenubuilder.exe=d;mscoree,mshtml=")
    }

    /// The folder of Windows' own libraries.
    fn system_folder(&self) -> PathBuf {
        let windows = self.prefix.path().join("drive_c/windows");
        let wow = windows.join("syswow64");
        if self.bits == WindowsBits::Bits32 && wow.is_dir() { wow } else { windows.join("system32") }
    }
}

fn wine_command(wine: &Path, prefix: &Path, overrides: &str) -> Command {
    let mut command = Command::new(wine);
    command.env("WINEPREFIX", prefix).env("WINEDLLOVERRIDES", overrides).env("WINEDEBUG", "-all");
    // Nothing of it is drawn.
    for name in ["DISPLAY", "WAYLAND_DISPLAY", "WINEARCH"] {
        command.env_remove(name);
    }
    command
}

/// Wine for libraries of this width: that of `PATH`, or the one that Debian keeps outside of it.
fn find_wine(bits: WindowsBits) -> Option<PathBuf> {
    if bits == WindowsBits::Bits32 && !has_libraries_of_32_bits() {
        return None;
    }
    let own = [PathBuf::from("/usr/lib/wine/wine64"), PathBuf::from("/usr/lib/wine/wine")];
    ["wine64", "wine"]
        .iter()
        .find_map(|name| find_program(name))
        .or_else(|| own.into_iter().find(|it| it.is_file()))
}

/// Whether Wine runs libraries of 32 bits, for which Debian has a package of another architecture.
fn has_libraries_of_32_bits() -> bool {
    let folders = ["/usr/lib/i386-linux-gnu/wine", "/usr/lib/wine", "/usr/lib32/wine"];
    folders.iter().any(|folder| Path::new(folder).join("i386-unix").is_dir())
}

/// Why Windows does not load a library, by the numbers of `winerror.h`.
pub(crate) fn describe_load_error(error: u64, path: &Path, setup: &WineSetup) -> String {
    match error {
        126 => {
            let missing = imports::missing_libraries(path, &setup.system_folder());
            match missing.as_slice() {
                [] => {
                    "it needs a library that neither its archive nor Wine has (Windows error 126)".to_owned()
                }
                names => format!(
                    "it needs {}, which neither its archive nor Wine has (Windows error 126)",
                    names.join(", ")
                ),
            }
        }
        127 => "it needs a function that Wine's libraries do not have (Windows error 127)".to_owned(),
        193 => "it is no library of Windows for this processor (Windows error 193)".to_owned(),
        1114 => "its start fails (Windows error 1114)".to_owned(),
        other => format!("Windows error {other}"),
    }
}
