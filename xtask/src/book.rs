//! The book: the pages of `docs/SUMMARY.md` as a static site. A test of the program checks the links between pages and their anchors.
//!
//! mdBook renders the pages in the folders that they have in the repository, so that links between them stay as they
//! are. A page may also link to a file that is no page (a header, a notebook, a picture); the book has a copy of it.
//!
//! Main functions: [`main`], [`build`], [`test()`]. Uses `web` for Chromium and `install` for mdBook.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Component, Path, PathBuf};

use anyhow::{Context, Result, ensure};

use crate::shell::{at_root, root, run};
use crate::{install, web};

/// Version of mdBook.
const VERSION: &str = "0.5.4";
/// The table of contents, from the repository's root.
const SUMMARY: &str = "docs/SUMMARY.md";
/// Folders whose pages must all be in the table of contents.
const COMPLETE: [&str; 2] = ["docs", "docs/notes"];
/// Settings of mdBook. Its preprocessors are off: a page is what its file holds, and `README.md` keeps its name.
const SETTINGS: &str = r#"[book]
title = "fingerpad"
description = "Fingertip friction from finite elements to microcontrollers"
language = "en"
src = "src"

[build]
build-dir = "html"
create-missing = false
use-default-preprocessors = false

[output.html]
additional-css = ["book.css"]
no-section-label = true
smart-punctuation = false
definition-lists = false
admonitions = false

[output.html.playground]
runnable = false

[output.html.print]
enable = false
"#;

/// Style beside mdBook's own: tables and commands need more width than text.
// A picture in a table would shrink to nothing on a narrow page.
const STYLE: &str = ":root { --content-max-width: 860px; }\ntd img { min-width: 150px; }\n";

/// Options of `cargo xtask book`.
#[derive(clap::Args)]
pub struct Args {
    /// Then write pictures of all pages, 1200 and 400 px wide in Chromium, to this folder
    #[arg(long, value_name = "FOLDER")]
    pictures: Option<PathBuf>,
    /// Then serve the book on this port of localhost, with Python
    #[arg(long, value_name = "PORT")]
    serve: Option<u16>,
}

/// Entry of the chore.
pub fn main(args: &Args) -> Result<()> {
    let site = build()?;
    if let Some(folder) = &args.pictures {
        web::book(&site, Some(folder))?;
    }
    if let Some(port) = args.serve {
        run(at_root("python3")
            .args(["-m", "http.server", "--bind", "127.0.0.1"])
            .arg(port.to_string())
            .arg("--directory")
            .arg(&site))?;
    }
    Ok(())
}

/// Builds the book, and checks in Chromium that all pages fit into a wide and a narrow window.
pub fn test() -> Result<()> {
    web::book(&build()?, None)
}

/// Builds the book. Returns the folder of the site.
///
/// # Errors
/// A page that the table of contents lacks, a linked file that does not exist, or a failure of mdBook.
pub fn build() -> Result<PathBuf> {
    let root = root();
    let folder = root.join("target/book");
    let mdbook = install::crate_program("mdbook", VERSION, "--no-default-features --features search")?;
    if folder.exists() {
        fs::remove_dir_all(&folder).with_context(|| folder.display().to_string())?;
    }
    let pages = stage(&root, &folder.join("src"))?;
    fs::write(folder.join("book.toml"), SETTINGS)?;
    fs::write(folder.join("book.css"), STYLE)?;
    run(at_root(mdbook).arg("build").arg(&folder))?;
    let site = folder.join("html");
    println!("{pages} pages: {}", site.join("index.html").display());
    Ok(site)
}

/// Copies the pages of the table of contents and the files that they link to below `source`. Returns the number of pages.
fn stage(root: &Path, source: &Path) -> Result<usize> {
    let summary = fs::read_to_string(root.join(SUMMARY)).with_context(|| SUMMARY.to_owned())?;
    let mut pages = BTreeSet::new();
    let mut listed = summary.clone();
    for target in targets(&summary) {
        let page = resolve(Path::new(SUMMARY), target).with_context(|| format!("{SUMMARY}: {target}"))?;
        listed = listed.replace(&format!("]({target})"), &format!("]({})", page.display()));
        ensure!(pages.insert(page.clone()), "{SUMMARY} lists {} twice", page.display());
    }
    for folder in COMPLETE {
        for entry in fs::read_dir(root.join(folder))? {
            let page = Path::new(folder).join(entry?.file_name());
            let is_page = page.extension().is_some_and(|extension| extension == "md") && page != Path::new(SUMMARY);
            ensure!(!is_page || pages.contains(&page), "{SUMMARY} does not list {}", page.display());
        }
    }
    for page in &pages {
        let text = fs::read_to_string(root.join(page)).with_context(|| page.display().to_string())?;
        for target in targets(&text) {
            let Some(file) = resolve(page, target).filter(|file| !pages.contains(file)) else { continue };
            let from = root.join(&file);
            let (page, file) = (page.display(), file.display());
            ensure!(from.exists(), "{page} links to {target}, which does not exist");
            ensure!(!from.is_dir(), "{page} links to the folder {file}; the book needs a file");
            ensure!(
                from.extension().is_none_or(|e| e != "md"),
                "{page} links to {file}, which {SUMMARY} does not list"
            );
            let to = source.join(file.to_string());
            fs::create_dir_all(to.parent().context("a file of the root")?)?;
            fs::copy(&from, &to)?;
        }
        let to = source.join(page);
        fs::create_dir_all(to.parent().context("a page of the root")?)?;
        fs::write(to, text)?;
    }
    fs::write(source.join("SUMMARY.md"), listed)?;
    Ok(pages.len())
}

/// Relative targets of the links and pictures of a page, without their anchors.
fn targets(text: &str) -> Vec<&str> {
    let prose = text.split("\n```").step_by(2);
    let links = prose.flat_map(|prose| prose.split("](").skip(1)).filter_map(|rest| rest.split(')').next());
    let files = links.map(|link| link.split('#').next().unwrap_or_default());
    files.filter(|file| !file.is_empty() && !file.contains([' ', ':', '['])).collect()
}

/// A link of `page` from the repository's root; none if it leads out of the repository.
fn resolve(page: &Path, link: &str) -> Option<PathBuf> {
    let mut to = page.parent()?.to_owned();
    for part in Path::new(link).components() {
        match part {
            Component::ParentDir => to.pop().then_some(())?,
            Component::Normal(name) => to.push(name),
            _ => {}
        }
    }
    Some(to)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_takes_along_the_files_that_it_links_to() {
        let root = tempfile::tempdir().unwrap();
        for folder in COMPLETE {
            fs::create_dir_all(root.path().join(folder)).unwrap();
        }
        let write = |name: &str, text: &str| fs::write(root.path().join(name), text).unwrap();
        write(SUMMARY, "# Contents\n\n- [Start](../README.md)\n- [A](a.md)\n");
        write("README.md", "[A](docs/a.md#b) [web](https://example.org)\n\n```text\n[no](link.md)\n```\n");
        write("docs/a.md", "![P](p.png) [Start](../README.md)\n");
        write("docs/p.png", "picture");
        let source = root.path().join("book");
        assert_eq!(stage(root.path(), &source).unwrap(), 2);
        assert_eq!(fs::read_to_string(source.join("docs/p.png")).unwrap(), "picture");
        let summary = fs::read_to_string(source.join("SUMMARY.md")).unwrap();
        assert_eq!(summary, "# Contents\n\n- [Start](README.md)\n- [A](docs/a.md)\n");

        let refused = |why: &str| {
            let error = stage(root.path(), &source).unwrap_err().to_string();
            assert!(error.contains(why), "{error}");
        };
        write("docs/notes/b.md", "A page without a link to it.\n");
        refused("does not list docs/notes/b.md");
        write(SUMMARY, "- [Start](../README.md)\n- [A](a.md)\n- [B](notes/b.md)\n");
        write("docs/notes/b.md", "[gone](gone.png)\n");
        refused("docs/notes/b.md links to gone.png");
        write("docs/notes/b.md", "[folder](../notes)\n");
        refused("links to the folder docs/notes");
        write("NEWS.md", "");
        write("docs/notes/b.md", "[news](../../NEWS.md)\n");
        refused("links to NEWS.md, which docs/SUMMARY.md does not list");
    }
}
