//! No two files use each other, not even over others: what a file needs can be read below it.
//!
//! Read off the `use` lines and paths of every package of the workspace with syn. What is
//! compiled for tests alone does not count, and a name that a file only hands on counts as its
//! owner's.
#![allow(clippy::expect_used, reason = "a test that cannot go on fails")]

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use syn::visit::{self, Visit};
use syn::{Attribute, ItemMod, ItemUse, UseTree, Visibility};

/// The sources of every package of the workspace, as its manifest lists them.
fn sources() -> Vec<String> {
    let manifest = std::fs::read_to_string(tests::root().join("Cargo.toml"));
    let manifest: toml::Table = manifest
        .expect("the manifest can be read")
        .parse()
        .expect("the manifest is TOML");
    let members = manifest["workspace"]["members"].as_array();
    let members = members.expect("members are a list").iter();
    let names = members.map(|member| member.as_str().expect("a member is a path"));
    let sources: Vec<String> = names.map(|name| format!("{name}/src")).collect();
    for source in &sources {
        assert!(tests::root().join(source).is_dir(), "{source}");
    }
    sources
}

/// A module's path below its crate; empty for the crate's root.
type Module = Vec<String>;

/// The names that a file mentions.
#[derive(Default)]
struct Mentions {
    /// Modules inside the file around the item that is looked at.
    inside: Vec<String>,
    /// Paths, each with the modules inside the file around it.
    used: Vec<(Vec<String>, Vec<String>)>,
    /// Paths that the file hands on.
    handed_on: Vec<Vec<String>>,
}

impl<'ast> Visit<'ast> for Mentions {
    fn visit_item_mod(&mut self, item: &'ast ItemMod) {
        if !for_tests(&item.attrs) {
            self.inside.push(item.ident.to_string());
            visit::visit_item_mod(self, item);
            self.inside.pop();
        }
    }

    fn visit_item_use(&mut self, item: &'ast ItemUse) {
        if for_tests(&item.attrs) {
            return;
        }
        let mut paths = Vec::new();
        flatten(&item.tree, &[], &mut paths);
        if matches!(item.vis, Visibility::Inherited) {
            let inside = &self.inside;
            let with = paths.into_iter().map(|path| (inside.clone(), path));
            self.used.extend(with);
        } else {
            self.handed_on.extend(paths);
        }
    }

    /// `pub(super)` names no user of the module above.
    fn visit_vis_restricted(&mut self, _: &'ast syn::VisRestricted) {}

    fn visit_path(&mut self, path: &'ast syn::Path) {
        let names = path.segments.iter().map(|part| part.ident.to_string());
        self.used.push((self.inside.clone(), names.collect()));
        visit::visit_path(self, path);
    }
}

fn for_tests(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        let is_test = |name: syn::Ident| name == "test";
        attribute.path().is_ident("cfg") && attribute.parse_args().is_ok_and(is_test)
    })
}

/// The paths of a `use`.
fn flatten(tree: &UseTree, before: &[String], paths: &mut Vec<Vec<String>>) {
    let with = |name: String| [before, &[name]].concat();
    match tree {
        UseTree::Path(path) => flatten(&path.tree, &with(path.ident.to_string()), paths),
        UseTree::Name(name) => paths.push(with(name.ident.to_string())),
        UseTree::Rename(name) => paths.push(with(name.ident.to_string())),
        UseTree::Glob(_) => paths.push(before.to_vec()),
        UseTree::Group(group) => {
            for tree in &group.items {
                flatten(tree, before, paths);
            }
        }
    }
}

/// The files of a package, by their modules; tests left out.
fn files(folder: &Path, module: &Module, found: &mut BTreeMap<Module, PathBuf>) {
    let entries = std::fs::read_dir(folder).expect("the folder can be read");
    for entry in entries {
        let path = entry.expect("the folder can be read").path();
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        if stem == "tests" {
            continue;
        }
        let inner = [module.as_slice(), &[stem.to_string()]].concat();
        if path.is_dir() {
            files(&path, &inner, found);
        } else if path.extension().is_some_and(|end| end == "rs") {
            // A program beside a library is a crate of its own.
            let beside = stem == "main" && folder.join("lib.rs").exists();
            let is_folder = matches!(&*stem, "lib" | "main" | "mod") && !beside;
            found.insert(if is_folder { module.clone() } else { inner }, path);
        }
    }
}

/// The absolute form of a path inside a crate; `None` for another crate's.
fn absolute(at: &Module, path: &[String], files: &BTreeMap<Module, PathBuf>) -> Option<Module> {
    let first = path.first()?.as_str();
    match first {
        "crate" => Some(path[1..].to_vec()),
        "self" => Some([at, &path[1..]].concat()),
        "super" => {
            let ups = path.iter().take_while(|name| *name == "super").count();
            let base = at.len().checked_sub(ups)?;
            Some([&at[..base], &path[ups..]].concat())
        }
        _ => {
            let child = [at.as_slice(), &[first.to_owned()]].concat();
            let is_child = files.contains_key(&child);
            is_child.then(|| [at.as_slice(), path].concat())
        }
    }
}

/// The file that holds what a path names: the longest part of it that is one.
fn owner(path: &Module, files: &BTreeMap<Module, PathBuf>) -> Option<Module> {
    (0..=path.len())
        .rev()
        .map(|length| path[..length].to_vec())
        .find(|part| files.contains_key(part))
}

/// Which files a package's files use.
fn graph(folder: &Path) -> BTreeMap<Module, BTreeSet<Module>> {
    let mut modules = BTreeMap::new();
    files(folder, &Vec::new(), &mut modules);
    assert!(!modules.is_empty(), "{}", folder.display());
    let mut mentions = BTreeMap::new();
    for (module, path) in &modules {
        let text = std::fs::read_to_string(path).expect("the file can be read");
        let file = syn::parse_file(&text).expect("the file is Rust");
        let mut found = Mentions::default();
        found.visit_file(&file);
        mentions.insert(module.clone(), found);
    }
    let handed_on = |module: &Module, name: &str| {
        let paths = &mentions[module].handed_on;
        let path = paths
            .iter()
            .find(|path| path.last().is_some_and(|last| last == name))?;
        owner(&absolute(module, path, &modules)?, &modules)
    };
    let uses = |module: &Module| {
        let mut uses = BTreeSet::new();
        for (inside, path) in &mentions[module].used {
            let at = [module.as_slice(), inside].concat();
            let Some(full) = absolute(&at, path, &modules) else {
                continue;
            };
            let Some(mut file) = owner(&full, &modules) else {
                continue;
            };
            if let Some(name) = full.get(file.len())
                && let Some(real) = handed_on(&file, name)
            {
                file = real;
            }
            if file != *module {
                uses.insert(file);
            }
        }
        uses
    };
    modules
        .keys()
        .map(|module| (module.clone(), uses(module)))
        .collect()
}

/// What a file reaches over any number of uses.
fn reached<'g>(
    graph: &'g BTreeMap<Module, BTreeSet<Module>>,
    from: &Module,
) -> BTreeSet<&'g Module> {
    let mut reached = BTreeSet::new();
    let mut open: Vec<&Module> = graph[from].iter().collect();
    while let Some(next) = open.pop() {
        if reached.insert(next) {
            open.extend(&graph[next]);
        }
    }
    reached
}

#[test]
fn no_file_reaches_itself() {
    let mut circles = Vec::new();
    let sources = sources();
    assert!(sources.iter().any(|source| source == "table-gen/prob/src"));
    for source in sources {
        let graph = graph(&tests::root().join(&source));
        for (module, uses) in &graph {
            if !reached(&graph, module).contains(module) {
                continue;
            }
            let back = uses
                .iter()
                .filter(|next| reached(&graph, next).contains(module));
            let names: Vec<String> = back.map(|next| next.join("::")).collect();
            circles.push(format!(
                "{source}: {} -> {}",
                module.join("::"),
                names.join(", ")
            ));
        }
    }
    assert!(circles.is_empty(), "{}", circles.join("\n"));
}

#[test]
fn a_circle_is_seen() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| {
        std::fs::write(folder.path().join(name), text).expect("the file can be written");
    };
    write("lib.rs", "mod a; mod b; mod c; pub use a::A;");
    write("a.rs", "pub struct A; fn f() { super::b::g(); }");
    write("b.rs", "use crate::c::h; pub fn g() {}");
    // Over the name that the root hands on.
    write(
        "c.rs",
        "use crate::A; pub fn h() {} #[cfg(test)] mod tests { use crate::b; }",
    );
    let graph = graph(folder.path());
    let a = vec!["a".to_owned()];
    assert!(reached(&graph, &a).contains(&a));
    write(
        "c.rs",
        "pub fn h() {} #[cfg(test)] mod tests { use crate::A; }",
    );
    let graph = self::graph(folder.path());
    assert!(!reached(&graph, &a).contains(&a));
}
