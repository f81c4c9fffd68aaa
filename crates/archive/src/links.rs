//! Creates symbolic links of an archive that stay inside it, and refuses the others.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Component, Path, PathBuf};

use crate::Error;
use crate::folder::temporary_write_error;

/// A path may go through this many links, as in Linux.
const MOST: usize = 40;

/// The links of an archive, and the names that they must not have.
#[derive(Default)]
pub(crate) struct ArchiveLinks {
    /// The name in the archive, and where it leads, by their paths in the folder.
    links: BTreeMap<PathBuf, (String, String)>,
    /// Files and folders, and the folders that they are in, in small letters: some systems make no difference.
    entries: BTreeSet<String>,
}

impl ArchiveLinks {
    /// Notes a file or a folder.
    pub fn note_entry(&mut self, inside: &Path) {
        let all = inside.ancestors().filter(|path| !path.as_os_str().is_empty());
        self.entries.extend(all.map(lowercase_path));
    }

    /// Notes a link, its path in the folder, and where it leads.
    pub fn add_link(&mut self, name: String, inside: PathBuf, target: String) {
        if let Some(parent) = inside.parent() {
            self.note_entry(parent);
        }
        self.links.insert(inside, (name, target));
    }

    /// Makes the links: after all else, so that nothing is written through them.
    ///
    /// # Errors
    /// When one leads out of the folder, or has the name of something else.
    pub fn create_links(self, path: &Path, into: &Path) -> Result<(), Error> {
        for (inside, (name, target)) in &self.links {
            let refused =
                |why| Error::Link { path: path.to_owned(), entry: name.clone(), target: target.clone(), why };
            if self.entries.contains(&lowercase_path(inside)) {
                return Err(refused("and another entry has the same name"));
            }
            let start = inside.parent().unwrap_or(Path::new(""));
            self.resolve_target(start, target, &mut 0).map_err(refused)?;
        }
        for (inside, (_, target)) in &self.links {
            let place = into.join(inside);
            let made = place.parent().map_or(Ok(()), std::fs::create_dir_all);
            let made = made.and_then(|()| create_symlink(&target.replace('\\', "/"), &place));
            made.map_err(|source| Error::Read {
                path: path.to_owned(),
                source: temporary_write_error(into, source),
            })?;
        }
        Ok(())
    }

    /// Where a path leads that begins in a folder of the archive.
    fn resolve_target(&self, start: &Path, target: &str, seen: &mut usize) -> Result<PathBuf, &'static str> {
        const OUT: &str = "which is outside of the archive";
        *seen += 1;
        if *seen > MOST {
            return Err("which is a circle of links");
        }
        let mut now = start.to_owned();
        for part in Path::new(&target.replace('\\', "/")).components() {
            match part {
                Component::CurDir => {}
                Component::ParentDir => {
                    if !now.pop() {
                        return Err(OUT);
                    }
                }
                Component::Normal(name) if name.to_string_lossy().contains(':') => return Err(OUT),
                Component::Normal(name) => {
                    now.push(name);
                    if let Some((_, next)) = self.links.get(&now) {
                        now.pop();
                        now = self.resolve_target(&now, next, seen)?;
                    }
                }
                Component::RootDir | Component::Prefix(_) => return Err(OUT),
            }
        }
        Ok(now)
    }
}

fn lowercase_path(path: &Path) -> String {
    path.to_string_lossy().to_lowercase()
}

#[cfg(unix)]
fn create_symlink(target: &str, place: &Path) -> std::io::Result<()> {
    std::os::unix::fs::symlink(target, place)
}

#[cfg(not(unix))]
fn create_symlink(_: &str, _: &Path) -> std::io::Result<()> {
    Err(std::io::Error::other("this system makes no links"))
}
