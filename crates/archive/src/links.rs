//! Creates symbolic links of an archive that stay inside it, and refuses the others.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Component, Path, PathBuf};

use crate::Error;
use crate::folder::unwritable;

/// A path may go through this many links, as in Linux.
const MOST: usize = 40;

/// The links of an archive, and the names that they must not have.
#[derive(Default)]
pub(crate) struct Links {
    /// The name in the archive, and where it leads, by their paths in the folder.
    links: BTreeMap<PathBuf, (String, String)>,
    /// Files and folders, and the folders that they are in, in small letters: some systems make no difference.
    entries: BTreeSet<String>,
}

impl Links {
    /// Notes a file or a folder.
    pub fn note_entry(&mut self, inside: &Path) {
        let all = inside.ancestors().filter(|path| !path.as_os_str().is_empty());
        self.entries.extend(all.map(lowercase));
    }

    /// Notes a link, its path in the folder, and where it leads.
    pub fn add(&mut self, name: String, inside: PathBuf, target: String) {
        if let Some(parent) = inside.parent() {
            self.note_entry(parent);
        }
        self.links.insert(inside, (name, target));
    }

    /// Makes the links: after all else, so that nothing is written through them.
    ///
    /// # Errors
    /// When one leads out of the folder, or has the name of something else.
    pub fn make(self, path: &Path, into: &Path) -> Result<(), Error> {
        for (inside, (name, target)) in &self.links {
            let refused = |why| Error::Link {
                path: path.to_owned(),
                entry: name.clone(),
                target: target.clone(),
                why,
            };
            if self.entries.contains(&lowercase(inside)) {
                return Err(refused("and another entry has the same name"));
            }
            let start = inside.parent().unwrap_or(Path::new(""));
            self.follow(start, target, &mut 0).map_err(refused)?;
        }
        for (inside, (_, target)) in &self.links {
            let place = into.join(inside);
            let made = place.parent().map_or(Ok(()), std::fs::create_dir_all);
            let made = made.and_then(|()| link(&target.replace('\\', "/"), &place));
            made.map_err(|source| Error::Read {
                path: path.to_owned(),
                source: unwritable(into, source),
            })?;
        }
        Ok(())
    }

    /// Where a path leads that begins in a folder of the archive.
    fn follow(
        &self,
        start: &Path,
        target: &str,
        seen: &mut usize,
    ) -> Result<PathBuf, &'static str> {
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
                        now = self.follow(&now, next, seen)?;
                    }
                }
                Component::RootDir | Component::Prefix(_) => return Err(OUT),
            }
        }
        Ok(now)
    }
}

fn lowercase(path: &Path) -> String {
    path.to_string_lossy().to_lowercase()
}

#[cfg(unix)]
fn link(target: &str, place: &Path) -> std::io::Result<()> {
    std::os::unix::fs::symlink(target, place)
}

#[cfg(not(unix))]
fn link(_: &str, _: &Path) -> std::io::Result<()> {
    Err(std::io::Error::other("this system makes no links"))
}
