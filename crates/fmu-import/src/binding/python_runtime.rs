//! Starts the Python that FMUs of PythonFMU expect in the process, and imports their scripts.
//!
//! Each of them starts Python if nobody has, and the one that started it ends it with its last instance, also below the others. Packages
//! of C such as numpy do not survive a second start. So this program starts it first, without handlers of signals, and never ends it.

use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::path::Path;
use std::sync::{Mutex, PoisonError};

use libloading::os::unix::{Library, RTLD_GLOBAL, RTLD_NOW, Symbol};
use python::PythonLibrary;

use super::process_state::{ProcessStateSnapshot, restore_process_state};
use crate::Fmu;

/// Nobody ends Python, which writes out what is left of printed lines.
const LINES: &CStr = c"import sys
for file in (sys.stdout, sys.stderr):
    if hasattr(file, 'reconfigure'):
        file.reconfigure(line_buffering=True)
";

/// The file of an archive with the name of the script, which PythonFMU and PythonFMU3 import.
const SCRIPT: &str = "resources/slavemodule.txt";

/// Imports the script before the FMU does: where that fails, some FMUs say nothing, and others crash. FOLDER and NAME are texts in
/// hexadecimal digits.
const IMPORT: &str = "import importlib, sys
def _trackside_import(folder, name):
    sys.path.insert(0, folder)
    try:
        importlib.import_module(name)
        return ''
    except BaseException as error:
        return f'{type(error).__name__}: {error}'
    finally:
        sys.path.remove(folder)
_trackside_failure = _trackside_import(bytes.fromhex('FOLDER').decode(), bytes.fromhex('NAME').decode())
";

/// A function that runs a text in the module `__main__`.
type RunTextFn = unsafe extern "C" fn(*const c_char, *mut c_void) -> c_int;

/// Whether this program started Python.
static STARTED: Mutex<bool> = Mutex::new(false);

/// Loads and starts the Python of an FMU that expects one, unless this process has a Python for all of its libraries; and imports its script.
///
/// # Errors
/// In a sentence, when there is no such Python, its library does not load, or the script fails.
pub(super) fn start_expected_python(fmu: &Fmu) -> Result<(), String> {
    let mut started = STARTED.lock().unwrap_or_else(PoisonError::into_inner);
    // SAFETY: the address is looked at, not called.
    let is_there = || unsafe { Library::this().get::<*const ()>(b"Py_IsInitialized\0") }.is_ok();
    if !fmu.library_linkage().expects_python() || (!*started && is_there()) {
        return Ok(());
    }
    let Some(found) = fmu.python_library() else { return Ok(()) };
    let python = found.map_err(|what| format!("it expects Python in the process, and {what}"))?;
    let broken = |error| format!("{} does not load: {error}", python.path.display());
    if !*started {
        start_python(python).map_err(broken)?;
        *started = true;
    }
    let name = fmu.read_archive_entry(SCRIPT).and_then(|name| String::from_utf8(name).ok());
    let Some(name) = name.map(|name| name.trim().to_owned()) else { return Ok(()) };
    let Some(said) = import_script(&fmu.resources_folder(), &name).map_err(broken)? else { return Ok(()) };
    let (shown, advice) =
        (python.interpreter.display(), missing_module_advice(&said, fmu).unwrap_or_default());
    Err(format!("its script `{name}` does not load in {shown}: {said}{advice}"))
}

fn start_python(python: &PythonLibrary) -> Result<(), libloading::Error> {
    // SAFETY: it is the library of the Python that the user chose. It stays there, as its threads and modules do.
    std::mem::forget(unsafe { Library::open(Some(&python.path), RTLD_NOW | RTLD_GLOBAL) }?);
    let process = Library::this();
    // SAFETY: the signatures are those of the stable interface of Python (docs.python.org/3/c-api), but for wide characters, which have
    // 32 bits on all systems that this is built for. Nobody else calls Python meanwhile: no FMU of it is loaded yet.
    unsafe {
        let initialize: Symbol<unsafe extern "C" fn(c_int)> = process.get(b"Py_InitializeEx\0")?;
        let save_thread: Symbol<unsafe extern "C" fn() -> *mut c_void> =
            process.get(b"PyEval_SaveThread\0")?;
        let run: Symbol<RunTextFn> = process.get(b"PyRun_SimpleStringFlags\0")?;
        // Its start sets the locale.
        let before = ProcessStateSnapshot::capture();
        // Python finds its packages from there; newer ones without this function look into the search path.
        if let Ok(set_program_name) = process.get::<unsafe extern "C" fn(*const u32)>(b"Py_SetProgramName\0")
        {
            let name = python.interpreter.to_string_lossy();
            let wide: Vec<u32> = name.chars().map(u32::from).chain([0]).collect();
            set_program_name(wide.leak().as_ptr());
        }
        initialize(0);
        run(LINES.as_ptr(), std::ptr::null_mut());
        // Each thread takes the interpreter for its own calls.
        save_thread();
        restore_process_state(before.as_ref());
    }
    Ok(())
}

/// Imports a script in the Python that this program started; what went wrong.
fn import_script(folder: &Path, name: &str) -> Result<Option<String>, libloading::Error> {
    let digits = |text: &[u8]| text.iter().map(|byte| format!("{byte:02x}")).collect::<String>();
    let code = IMPORT.replace("FOLDER", &digits(folder.as_os_str().as_encoded_bytes()));
    let code = CString::new(code.replace("NAME", &digits(name.as_bytes()))).unwrap_or_default();
    let process = Library::this();
    // SAFETY: the signatures are those of docs.python.org/3/c-api. All calls lie between taking and giving back the interpreter; what is
    // read is copied while the dictionary holds it.
    unsafe {
        let ensure: Symbol<unsafe extern "C" fn() -> c_int> = process.get(b"PyGILState_Ensure\0")?;
        let release: Symbol<unsafe extern "C" fn(c_int)> = process.get(b"PyGILState_Release\0")?;
        let run: Symbol<RunTextFn> = process.get(b"PyRun_SimpleStringFlags\0")?;
        let module: Symbol<unsafe extern "C" fn(*const c_char) -> *mut c_void> =
            process.get(b"PyImport_AddModule\0")?;
        let dictionary: Symbol<unsafe extern "C" fn(*mut c_void) -> *mut c_void> =
            process.get(b"PyModule_GetDict\0")?;
        let item: Symbol<unsafe extern "C" fn(*mut c_void, *const c_char) -> *mut c_void> =
            process.get(b"PyDict_GetItemString\0")?;
        let text: Symbol<unsafe extern "C" fn(*mut c_void) -> *const c_char> =
            process.get(b"PyUnicode_AsUTF8\0")?;
        let before = ProcessStateSnapshot::capture();
        let state = ensure();
        let mut said = None;
        if run(code.as_ptr(), std::ptr::null_mut()) == 0 {
            let found = item(dictionary(module(c"__main__".as_ptr())), c"_trackside_failure".as_ptr());
            let found = if found.is_null() { std::ptr::null() } else { text(found) };
            if !found.is_null() {
                said = Some(CStr::from_ptr(found).to_string_lossy().into_owned());
            }
        }
        release(state);
        restore_process_state(before.as_ref());
        Ok(said.filter(|said| !said.is_empty()))
    }
}

/// What to do when a script of an FMU misses a module, to be appended to what is said of it; nothing when it misses none.
pub(super) fn missing_module_advice(said: &str, fmu: &Fmu) -> Option<String> {
    let module = python::missing_module(said)?;
    let python = &fmu.python_library()?.ok()?.interpreter;
    Some(format!("; type {}", python::module_install_advice(python, module)))
}
