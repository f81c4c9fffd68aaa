//! Finds the words of a scenario that name files, but for those of FMUs.

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::text_of;

/// What a word that names a file is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Role {
    /// A file that is read as it is.
    File,
    /// A file of parameters, which names files itself.
    Parameters,
    /// An archive of an FMU among the values of a sweep.
    Archive,
    /// Draws that a sweep varies, by the place of the entry that names them.
    Draws(usize),
    /// The scenario of a validation, by its place among them.
    Validation(usize),
    /// An entry of `set`: a file behind `@`, or a value.
    Values,
}

/// The entries of a list of tables.
pub(super) fn entries<'t, 'a>(
    root: &'t mut DeTable<'a>,
    list: &str,
) -> impl Iterator<Item = &'t mut DeTable<'a>> {
    let list = root.get_mut(list).and_then(|value| match value.get_mut() {
        DeValue::Array(list) => Some(list.iter_mut()),
        _ => None,
    });
    list.into_iter().flatten().filter_map(|entry| match entry.get_mut() {
        DeValue::Table(table) => Some(table),
        _ => None,
    })
}

/// Calls `take` for each of the words.
pub(super) fn each<'a>(
    root: &mut DeTable<'a>,
    take: &mut dyn FnMut(Role, &mut Spanned<DeValue<'a>>),
) {
    let lists = [
        ("table", "path"),
        ("table", "aliases"),
        ("baseline", "recording"),
        ("analysis", "path"),
        ("analysis", "python"),
    ];
    for (list, key) in lists {
        entries(root, list).for_each(|entry| one(entry, key, Role::File, take));
    }
    for list in ["fmu", "analysis"] {
        for entry in entries(root, list) {
            match entry.get_mut("parameters") {
                Some(value) if value.get_ref().is_array() => {
                    let DeValue::Array(files) = value.get_mut() else { continue };
                    files.iter_mut().for_each(|file| take(Role::Parameters, file));
                }
                Some(file) => take(Role::Parameters, file),
                None => {}
            }
        }
    }
    for fmu in entries(root, "fmu") {
        if let Some(start) = inner(fmu, "start") {
            texts(start, take);
        }
    }
    for analysis in entries(root, "analysis") {
        if let Some(table) = inner(analysis, "table") {
            match table.get_mut("path").map(Spanned::get_mut) {
                Some(DeValue::Array(logs)) => logs.iter_mut().for_each(|it| take(Role::File, it)),
                _ => one(table, "path", Role::File, take),
            }
            one(table, "aliases", Role::File, take);
        }
        if let Some(files) = inner(analysis, "files") {
            files.iter_mut().for_each(|(_, file)| take(Role::File, file));
        }
    }
    if let Some(sweep) = inner(root, "sweep") {
        one(sweep, "list", Role::File, take);
        for (index, vary) in entries(sweep, "vary").enumerate() {
            one(vary, "draws", Role::Draws(index), take);
            let archives = vary.get("name").and_then(|name| name.get_ref().as_str());
            let archives = archives.is_some_and(|name| name.ends_with(".path"));
            if let Some(DeValue::Array(values)) = vary.get_mut("values").map(Spanned::get_mut) {
                values.iter_mut().filter(|_| archives).for_each(|it| take(Role::Archive, it));
            }
        }
    }
    let track = inner(root, "view").and_then(|view| inner(view, "track"));
    if let Some(track) = track {
        one(track, "path", Role::File, take);
    }
    for (index, validation) in entries(root, "validation").enumerate() {
        one(validation, "scenario", Role::Validation(index), take);
        if let Some(DeValue::Array(set)) = validation.get_mut("set").map(Spanned::get_mut) {
            set.iter_mut().for_each(|entry| take(Role::Values, entry));
        }
    }
}

/// Calls `take` for each file whose text is a value.
pub(super) fn texts<'a>(
    values: &mut DeTable<'a>,
    take: &mut dyn FnMut(Role, &mut Spanned<DeValue<'a>>),
) {
    for (_, value) in values.iter_mut() {
        let DeValue::Table(inner) = value.get_mut() else { continue };
        match text_of::names_file(inner) {
            true => one(inner, text_of::KEY, Role::File, take),
            false => texts(inner, take),
        }
    }
}

fn one<'a>(
    table: &mut DeTable<'a>,
    key: &str,
    role: Role,
    take: &mut dyn FnMut(Role, &mut Spanned<DeValue<'a>>),
) {
    if let Some(value) = table.get_mut(key) {
        take(role, value);
    }
}

fn inner<'t, 'a>(table: &'t mut DeTable<'a>, key: &str) -> Option<&'t mut DeTable<'a>> {
    match table.get_mut(key)?.get_mut() {
        DeValue::Table(inner) => Some(inner),
        _ => None,
    }
}
