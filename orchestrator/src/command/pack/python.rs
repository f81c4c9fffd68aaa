//! `trackside pack --python`: packs a Python script as an FMU.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use ::python::{
    MODEL_SERVER, MODEL_SERVER_PATH, PythonException, PythonInterpreter, ScriptError, missing_module,
    module_install_advice,
};
use diagnostics::{Error, SourceFiles, TextFile};
use fmu_export::pack::{FmiVersion, is_identifier};
use orchestrator::package::{BuildProgress, BuildTarget};
use python_model::PackedScript;

use super::fmu_package::FmuPackage;
use crate::command::progress::BuildLine;
use crate::command::{print_text, print_to_stderr};

/// The package whose library asks the process of a script.
const LIBRARY: &str = "python-fmu";

/// The largest file that goes into an FMU with a script [bytes].
const LARGEST: u64 = 256 << 20;

/// What to pack, and how.
pub struct PackOptions<'a> {
    /// The script.
    pub script: &'a Path,
    /// Name of the FMU.
    pub name: Option<&'a str>,
    /// The class in the script.
    pub class: Option<&'a str>,
    /// Files and folders that it needs.
    pub with: &'a [PathBuf],
    /// Its version of FMI.
    pub version: FmiVersion,
    /// The targets whose libraries are in the archive, too.
    pub targets: &'a [BuildTarget],
    /// The folder of the archive.
    pub out: &'a Path,
}

/// Packs a script and prints the path of the archive.
///
/// # Errors
/// When the script does not load, is no model, or the archive cannot be written.
pub fn pack_python_script(order: &PackOptions) -> Result<u8, Error> {
    let PackOptions { script, name, class, .. } = *order;
    let stem = script.file_stem().unwrap_or_default().to_string_lossy();
    let name = name.unwrap_or(&stem);
    if !is_identifier(name) {
        let error = Error::invalid_input(format!(
            "expected a name of letters, digits and `_` without a digit in front, found `{name}`"
        ));
        return Err(error.with_help("name the FMU: --name NAME"));
    }
    refuse_windows(order.targets)?;
    let mut resources = BTreeMap::new();
    let file = resource_name(script)?;
    read_resource_files(script, file.clone(), &mut resources)?;
    for path in order.with {
        read_resource_files(path, resource_path(script, path)?, &mut resources)?;
    }
    resources.insert(MODEL_SERVER_PATH.to_owned(), MODEL_SERVER.as_bytes().to_vec());
    // What the script imports must be in the archive, so it is asked where nothing else is.
    let folder = tempfile::tempdir().map_err(|error| Error::output_failure(Path::new("."), error))?;
    write_resource_files(folder.path(), &resources)?;
    let interpreter = PythonInterpreter::choose_interpreter(None);
    let described = python_model::describe_script(&interpreter, folder.path(), &file, class, name)
        .map_err(|failure| script_load_error(order, &resources, &interpreter, failure))?;
    let PackedScript { mut interface, table, unsaved, python, printed } = described;
    printed.iter().for_each(|line| print_to_stderr(line));
    let mut building = BuildLine::default();
    let progress = &mut |progress: BuildProgress| building.show(&progress);
    let libraries = super::library::find_package_libraries(LIBRARY, order.targets, progress)?;
    // The identity is that of all that is in the archive, but not of the place of Python on this machine.
    let (version, out) = (order.version, order.out);
    let package = FmuPackage { name, version, out, table: &table, libraries: &libraries };
    interface.guid = package.content_guid(&resources);
    let path = package.write_archive(&interface.guid, resources, python_model::INTERFACE, &interface)?;
    if let Some(reason) = unsaved {
        print_to_stderr(&format!(
            "note: the FMU has no copies of its state, so no checkpoints: {reason}; methods `save` and `restore` of the class can do without it"
        ));
    }
    print_text(&format!("{} (Python {python})\n", path.display()));
    Ok(0)
}

/// Refuses a target that the library of a script does not know how to start a process on.
fn refuse_windows(targets: &[BuildTarget]) -> Result<(), Error> {
    let Some(target) = targets.iter().find(|target| target.platform.is_windows()) else { return Ok(()) };
    Err(Error::invalid_input(format!(
        "--target {}: expected another system than Windows, since the FMU of a Python script talks to its process by a Unix socket as standard input, which Windows has not",
        target.triple
    )))
}

/// The name of a file in the folder of resources.
fn resource_name(path: &Path) -> Result<String, Error> {
    let name = path.file_name().and_then(|name| name.to_str());
    match name {
        Some(name) if name != python_model::INTERFACE && name != "trackside" => Ok(name.to_owned()),
        _ => Err(Error::invalid_input(format!(
            "expected a file whose name is UTF-8 and neither `{}` nor `trackside`, found {}",
            python_model::INTERFACE,
            path.display()
        ))),
    }
}

/// The path of a file in the folder of resources: as it lies to the script, or its name when it lies elsewhere.
fn resource_path(script: &Path, path: &Path) -> Result<String, Error> {
    let canonical = |path: &Path| std::fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let (path, script) = (canonical(path), canonical(script));
    let own = script.parent().and_then(|folder| path.strip_prefix(folder).ok());
    match own.and_then(Path::to_str).filter(|own| !own.is_empty()) {
        Some(own) => {
            resource_name(own.split('/').next().unwrap_or_default().as_ref()).map(|_| own.to_owned())
        }
        None => resource_name(&path),
    }
}

/// Reads a file, or all files of a folder but those that Python or others put there for themselves.
fn read_resource_files(path: &Path, name: String, into: &mut BTreeMap<String, Vec<u8>>) -> Result<(), Error> {
    let wrong = |error: std::io::Error| Error::invalid_input(format!("{}: {error}", path.display()));
    let about = std::fs::metadata(path).map_err(wrong)?;
    if about.is_dir() {
        for entry in std::fs::read_dir(path).map_err(wrong)? {
            let entry = entry.map_err(wrong)?.path();
            let own = resource_name(&entry)?;
            if own != "__pycache__" && !own.starts_with('.') {
                read_resource_files(&entry, format!("{name}/{own}"), into)?;
            }
        }
        return Ok(());
    }
    if about.len() > LARGEST {
        let (path, length) = (path.display(), about.len());
        return Err(Error::invalid_input(format!(
            "expected a file of at most {LARGEST} bytes, found {path} with {length}"
        )));
    }
    into.insert(name, std::fs::read(path).map_err(wrong)?);
    Ok(())
}

fn write_resource_files(folder: &Path, files: &BTreeMap<String, Vec<u8>>) -> Result<(), Error> {
    files.iter().try_for_each(|(name, bytes)| {
        let path = folder.join(name);
        let above = path.parent().unwrap_or(folder);
        let done = std::fs::create_dir_all(above).and_then(|()| std::fs::write(&path, bytes));
        done.map_err(|error| Error::output_failure(&path, error))
    })
}

/// The error of a script that does not load, at its line.
fn script_load_error(
    order: &PackOptions,
    resources: &BTreeMap<String, Vec<u8>>,
    interpreter: &PythonInterpreter,
    failure: ScriptError,
) -> Error {
    let ScriptError::Exception(PythonException { message, file, line, .. }) = failure else {
        return Error::invalid_input(format!("{}: {failure}", order.script.display()));
    };
    let path = |file: &String| order.script.with_file_name(file);
    let place = file.as_ref().zip(line).and_then(|(file, line)| {
        let text = String::from_utf8(resources.get(file)?.clone()).ok()?;
        let begin = text.split_inclusive('\n').take(line - 1).map(str::len).sum::<usize>();
        let words = text.get(begin..)?.lines().next().unwrap_or_default();
        let indent = words.len() - words.trim_start().len();
        let range = begin + indent..begin + words.trim_end().len().max(indent);
        Some((SourceFiles::from_generated(TextFile::new(path(file), text)), range))
    });
    let error = match place {
        Some((source, range)) => source.error_at(range, &message, ""),
        None => Error::invalid_input(format!("{}: {message}", order.script.display())),
    };
    let Some(module) = missing_module(&message) else { return error };
    let own = [format!("{module}.py"), module.to_owned()];
    match own.into_iter().find(|name| path(name).exists()) {
        Some(own) => error.with_help(format!("to take it along: --with {}", path(&own).display())),
        None => {
            let python = interpreter.path.display();
            let advice = module_install_advice(&interpreter.path, module);
            error.with_help(format!("install it for {python} ({}) by {advice}", interpreter.reason))
        }
    }
}
