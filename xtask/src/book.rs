//! The book: the pages of `docs/SUMMARY.md` as a static site, and a check of its links.
//!
//! mdBook renders the pages in the folders that they have in the repository, so that links between them stay as they
//! are. A page may also link to a file that is no page (a header, a notebook, a picture); the book has a copy of it.
//!
//! Main functions: [`main`], [`build`], [`test()`]. Uses `web` for Chromium and `install` to print commands.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Component, Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail, ensure};

use crate::{install, root, run, web};

/// Version of mdBook, which `cargo install` compiles into `target/book-tools`.
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
const STYLE: &str = ":root { --content-max-width: 860px; }\n";

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
        let mut server = Command::new("python3");
        server.args(["-m", "http.server", "--bind", "127.0.0.1", &port.to_string(), "--directory"]).arg(&site);
        run(&mut server)?;
    }
    Ok(())
}

/// Builds the book, and checks in Chromium that all pages fit into a wide and a narrow window.
pub fn test() -> Result<()> {
    web::book(&build()?, None)
}

/// Builds the book and checks its links. Returns the folder of the site.
///
/// # Errors
/// A page that the table of contents lacks, a link or picture that leads nowhere, or a failure of mdBook.
pub fn build() -> Result<PathBuf> {
    let root = root().canonicalize()?;
    let folder = root.join("target/book");
    let mdbook = mdbook(&root)?;
    if folder.exists() {
        fs::remove_dir_all(&folder).with_context(|| folder.display().to_string())?;
    }
    let pages = stage(&root, &folder.join("src"))?;
    fs::write(folder.join("book.toml"), SETTINGS)?;
    fs::write(folder.join("book.css"), STYLE)?;
    run(Command::new(mdbook).arg("build").arg(&folder))?;
    let site = folder.join("html");
    let broken = broken_links(&site)?;
    ensure!(broken.is_empty(), "{} links lead nowhere:\n{}", broken.len(), broken.join("\n"));
    println!("{pages} pages, all links checked: {}", site.join("index.html").display());
    Ok(site)
}

/// The program mdBook, installed if it is not there in this version; without optimisation, which makes compiling it twice as fast.
fn mdbook(root: &Path) -> Result<PathBuf> {
    let folder = root.join("target/book-tools");
    let program = folder.join("bin/mdbook");
    let version = Command::new(&program).arg("--version").output();
    if version.is_ok_and(|out| String::from_utf8_lossy(&out.stdout).trim() == format!("mdbook v{VERSION}")) {
        return Ok(program);
    }
    install::say(&format!("mdBook {VERSION} is compiled once, which takes a minute or two"));
    let mut cargo = Command::new(env!("CARGO"));
    cargo.current_dir(root).args(["install", "mdbook", "--version", VERSION, "--locked", "--force", "--debug"]);
    run(cargo.args(["--no-default-features", "--features", "search", "--root"]).arg(&folder))?;
    Ok(program)
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

/// Links and pictures of a site whose file or anchor does not exist, as `page: link`.
///
/// # Errors
/// A folder that cannot be read or that has no page.
fn broken_links(site: &Path) -> Result<Vec<String>> {
    let mut files = Vec::new();
    files_below(site, &mut files)?;
    let mut pages = BTreeMap::new();
    for file in files.iter().filter(|file| file.extension().is_some_and(|extension| extension == "html")) {
        pages.insert(file.strip_prefix(site)?.to_owned(), fs::read_to_string(file)?);
    }
    // Served for any address, with links of its own kind.
    pages.remove(Path::new("404.html"));
    ensure!(!pages.is_empty(), "{} has no page", site.display());
    let anchors: BTreeMap<&PathBuf, BTreeSet<&str>> =
        pages.iter().map(|(page, text)| (page, attributes(text, "id").collect())).collect();
    let mut broken = Vec::new();
    for (page, text) in &pages {
        for link in attributes(text, "href").chain(attributes(text, "src")) {
            let (file, anchor) = link.split_once('#').unwrap_or((link, ""));
            if link.contains(':') || link.starts_with("//") {
                continue;
            }
            let target = if file.is_empty() { Some(page.clone()) } else { resolve(page, file) };
            let there = target.is_some_and(|target| match anchors.get(&target) {
                Some(anchors) => anchor.is_empty() || anchors.contains(anchor),
                None => anchor.is_empty() && site.join(target).is_file(),
            });
            if !there {
                broken.push(format!("{}: {link}", page.display()));
            }
        }
    }
    Ok(broken)
}

/// Values of an attribute of a page's elements; text has no quotation mark after an equals sign without a space before.
fn attributes<'a>(html: &'a str, name: &str) -> impl Iterator<Item = &'a str> {
    let start = format!(" {name}=\"");
    let mut rest = html;
    std::iter::from_fn(move || {
        let value = &rest[rest.find(&start)? + start.len()..];
        let end = value.find('"')?;
        rest = &value[end..];
        Some(&value[..end])
    })
}

fn files_below(folder: &Path, found: &mut Vec<PathBuf>) -> Result<()> {
    for entry in fs::read_dir(folder).with_context(|| folder.display().to_string())? {
        let path = entry?.path();
        if path.is_dir() {
            files_below(&path, found)?;
        } else if path.is_file() {
            found.push(path);
        } else {
            bail!("{} is neither a file nor a folder", path.display());
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_that_lead_nowhere_are_found() {
        let site = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| {
            let file = site.path().join(name);
            fs::create_dir_all(file.parent().unwrap()).unwrap();
            fs::write(file, text).unwrap();
        };
        write("index.html", r##"<a href="docs/a.html#top"></a><a href="#here"></a><h1 id="here"></h1>"##);
        write("docs/a.html", r#"<h1 id="top"></h1><a href="../index.html"></a><img alt="a" src="b.png">"#);
        write("docs/b.png", "");
        assert_eq!(broken_links(site.path()).unwrap(), Vec::<String>::new());
        write(
            "docs/c.html",
            r##"<a href="a.html#bottom"></a><a href="#top"></a><img src="c.png"><a href="../../x"></a>"##,
        );
        let broken = broken_links(site.path()).unwrap();
        let wanted = ["a.html#bottom", "#top", "../../x", "c.png"];
        assert_eq!(broken, wanted.map(|link| format!("docs/c.html: {link}")));
    }

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
