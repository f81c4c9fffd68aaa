//! Finds the entries of a scenario that name files, but for those of FMUs.

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::text_of;

/// What a word that names a file is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum FileRole {
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
pub(super) fn list_entries<'t, 'a>(
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
pub(super) fn for_each_file<'a>(
    root: &mut DeTable<'a>,
    take: &mut dyn FnMut(FileRole, &mut Spanned<DeValue<'a>>),
) {
    let lists = [
        ("table", "path"),
        ("table", "aliases"),
        ("baseline", "recording"),
        ("analysis", "path"),
        ("analysis", "python"),
    ];
    for (list, key) in lists {
        list_entries(root, list).for_each(|entry| visit_key(entry, key, FileRole::File, take));
    }
    for list in ["fmu", "analysis"] {
        for entry in list_entries(root, list) {
            match entry.get_mut("parameters") {
                Some(value) if value.get_ref().is_array() => {
                    let DeValue::Array(files) = value.get_mut() else { continue };
                    files.iter_mut().for_each(|file| take(FileRole::Parameters, file));
                }
                Some(file) => take(FileRole::Parameters, file),
                None => {}
            }
        }
    }
    for fmu in list_entries(root, "fmu") {
        if let Some(start) = table_at(fmu, "start") {
            for_each_text(start, take);
        }
    }
    for analysis in list_entries(root, "analysis") {
        if let Some(table) = table_at(analysis, "table") {
            match table.get_mut("path").map(Spanned::get_mut) {
                Some(DeValue::Array(logs)) => logs.iter_mut().for_each(|it| take(FileRole::File, it)),
                _ => visit_key(table, "path", FileRole::File, take),
            }
            visit_key(table, "aliases", FileRole::File, take);
        }
        if let Some(files) = table_at(analysis, "files") {
            files.iter_mut().for_each(|(_, file)| take(FileRole::File, file));
        }
    }
    if let Some(sweep) = table_at(root, "sweep") {
        visit_key(sweep, "list", FileRole::File, take);
        for (index, vary) in list_entries(sweep, "vary").enumerate() {
            visit_key(vary, "draws", FileRole::Draws(index), take);
            let archives = vary.get("name").and_then(|name| name.get_ref().as_str());
            let archives = archives.is_some_and(|name| name.ends_with(".path"));
            if let Some(DeValue::Array(values)) = vary.get_mut("values").map(Spanned::get_mut) {
                values.iter_mut().filter(|_| archives).for_each(|it| take(FileRole::Archive, it));
            }
        }
    }
    if let Some(sweep) = table_at(root, "sweep") {
        for variant in list_entries(sweep, "variant") {
            let Some(set) = table_at(variant, "set") else { continue };
            for (name, value) in set.iter_mut() {
                let is_archive = name.get_ref().ends_with(".path");
                match value.get_mut() {
                    DeValue::Table(inner) if !is_archive => visit_key(inner, "path", FileRole::Archive, take),
                    _ if is_archive => take(FileRole::Archive, value),
                    _ => {}
                }
            }
        }
    }
    let track = table_at(root, "view").and_then(|view| table_at(view, "track"));
    if let Some(track) = track {
        visit_key(track, "path", FileRole::File, take);
    }
    for (index, validation) in list_entries(root, "validation").enumerate() {
        visit_key(validation, "scenario", FileRole::Validation(index), take);
        if let Some(DeValue::Array(set)) = validation.get_mut("set").map(Spanned::get_mut) {
            set.iter_mut().for_each(|entry| take(FileRole::Values, entry));
        }
    }
}

/// Calls `take` for each file whose text is a value.
pub(super) fn for_each_text<'a>(
    values: &mut DeTable<'a>,
    take: &mut dyn FnMut(FileRole, &mut Spanned<DeValue<'a>>),
) {
    for (_, value) in values.iter_mut() {
        let DeValue::Table(inner) = value.get_mut() else { continue };
        match text_of::is_text_file_reference(inner) {
            true => visit_key(inner, text_of::KEY, FileRole::File, take),
            false => for_each_text(inner, take),
        }
    }
}

fn visit_key<'a>(
    table: &mut DeTable<'a>,
    key: &str,
    role: FileRole,
    take: &mut dyn FnMut(FileRole, &mut Spanned<DeValue<'a>>),
) {
    if let Some(value) = table.get_mut(key) {
        take(role, value);
    }
}

fn table_at<'t, 'a>(table: &'t mut DeTable<'a>, key: &str) -> Option<&'t mut DeTable<'a>> {
    match table.get_mut(key)?.get_mut() {
        DeValue::Table(inner) => Some(inner),
        _ => None,
    }
}
