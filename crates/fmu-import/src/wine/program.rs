//! Finds the program for Windows that loads libraries under Wine, or compiles it.

use std::fs;
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use super::WindowsBits;
use crate::cache_folder::cache_folder;
use crate::program_search::find_program;
use crate::sha256_hex;

const SOURCE: &str = include_str!("windows_host.c");
/// A library that Wine may lack, which the program loads before others want it.
const PRIMITIVES: &str = include_str!("bcryptprimitives.c");

const PROGRAM: &str = "trackside-windows-host.exe";
const LIBRARY: &str = "bcryptprimitives.dll";

/// Whether it is there or can be made.
pub(super) fn is_available(bits: WindowsBits) -> bool {
    let is_there = |folder: PathBuf| folder.join(PROGRAM).is_file();
    installed_folder(bits).is_some_and(is_there)
        || compiled_folder(bits).is_ok_and(is_there)
        || compiler(bits).is_some()
}

/// The program for this width: the one that came with ours, or one that is compiled once.
///
/// # Errors
/// In a sentence, when neither is possible.
pub(super) fn find_or_compile(bits: WindowsBits) -> Result<PathBuf, String> {
    let ready = installed_folder(bits).map(|folder| folder.join(PROGRAM)).filter(|path| path.is_file());
    if let Some(path) = ready {
        return Ok(path);
    }
    let folder = compiled_folder(bits)?;
    let program = folder.join(PROGRAM);
    if program.is_file() {
        return Ok(program);
    }
    let failed =
        |what: String| format!("the program that loads libraries under Wine is not compiled: {what}");
    let compiler = compiler(bits).ok_or_else(|| failed("MinGW-w64 is not there".to_owned()))?;
    fs::create_dir_all(&folder).map_err(|error| failed(error.to_string()))?;
    compile(&compiler, &["-shared"], PRIMITIVES, &folder.join(LIBRARY), &["-ladvapi32"]).map_err(failed)?;
    // No console is made for a program with windows.
    compile(&compiler, &["-mwindows"], SOURCE, &program, &[]).map_err(failed)?;
    Ok(program)
}

/// Compiles a source to a path. Another run may do the same meanwhile, with the same result.
fn compile(
    compiler: &Path,
    options: &[&str],
    source: &str,
    path: &Path,
    libraries: &[&str],
) -> Result<(), String> {
    let fresh = path.with_extension(std::process::id().to_string());
    let mut command = Command::new(compiler);
    command.arg("-O2").args(options).args(["-x", "c", "-", "-o"]).arg(&fresh).args(libraries);
    command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped());
    let mut run = || {
        let mut child = command.spawn()?;
        child.stdin.take().map_or(Ok(()), |mut input| input.write_all(source.as_bytes()))?;
        child.wait_with_output()
    };
    let done = run().map_err(|error: io::Error| error.to_string())?;
    if !done.status.success() {
        return Err(String::from_utf8_lossy(&done.stderr).trim().to_owned());
    }
    fs::rename(&fresh, path).map_err(|error| error.to_string())
}

/// Where it lies when this program is installed, as by wheels: `python/build.py` puts it there.
fn installed_folder(bits: WindowsBits) -> Option<PathBuf> {
    let root = std::env::current_exe().ok()?.parent()?.parent()?.to_owned();
    Some(root.join("share/trackside/windows-host").join(bits.processor()))
}

/// Where a compiled one lies, by its source.
fn compiled_folder(bits: WindowsBits) -> Result<PathBuf, String> {
    let digest = sha256_hex([SOURCE, PRIMITIVES].concat().as_bytes());
    Ok(cache_folder()?.join(format!("windows-host-{}-{}", &digest[..16], bits.processor())))
}

fn compiler(bits: WindowsBits) -> Option<PathBuf> {
    let processor = bits.processor();
    let ends = ["gcc", "gcc-win32", "gcc-posix"];
    ends.iter().find_map(|end| find_program(&format!("{processor}-w64-mingw32-{end}")))
}
