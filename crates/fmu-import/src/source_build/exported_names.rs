//! Gives a library the plain names of the functions of FMI where its sources put the name of the model before them.

use std::path::Path;

use crate::linkage::defined_functions;

/// Functions that each library of its version has.
const KNOWN: [&str; 2] = ["fmi2FreeInstance", "fmi3FreeInstance"];

/// Options for the linker that add the plain names; none for a library that has them.
///
/// # Errors
/// When the library has no function of FMI.
pub(super) fn alias_options(library: &Path) -> Result<Vec<String>, String> {
    let names = defined_functions(library);
    if names.iter().any(|name| KNOWN.contains(&name.as_str())) {
        return Ok(Vec::new());
    }
    let prefix = |name: &String| -> Option<String> {
        let known = KNOWN.iter().find_map(|known| name.strip_suffix(known))?;
        (!known.is_empty()).then(|| known.to_owned())
    };
    let prefix = names.iter().find_map(prefix).ok_or_else(|| {
        format!("they define none of the functions that FMI has, such as {}", KNOWN.join(" or "))
    })?;
    let plain = |name: &String| -> Option<String> {
        let plain = name.strip_prefix(&prefix)?;
        plain.starts_with("fmi").then(|| format!("-Wl,--defsym={plain}={name}"))
    };
    Ok(names.iter().filter_map(plain).collect())
}
