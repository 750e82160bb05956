//! Words of the project's early private idiom, which must not come back into documents, comments and messages.
//!
//! A hit that is right where it stands is allowed by a comment on its line or on the line above:
//! `// words: allow "bears"`, in Markdown `<!-- words: allow "bears" -->`.

use std::fs;
use std::path::{Path, PathBuf};

/// A word or phrase, and the plain English in its place.
const REPLACED: [(&str, &str); 23] = [
    ("told", "reported, given, passed, printed"),
    ("tells", "states, reports, returns, shows"),
    ("tell", "report, print; distinguish (tell apart)"),
    ("telling", "report, message"),
    ("anew", "again, from the start"),
    ("begun", "started"),
    ("is no number", "is not a number, is not finite"),
    ("nobody", "no user, no caller, no one"),
    ("nobody's", "unowned, of no element"),
    ("answers with", "returns, responds with"),
    ("held load stays", "the static load does not relax"),
    ("what leaves", "skin that leaves, the part that leaves"),
    ("way since turn", "slip path since the last reversal"),
    ("stands in for", "replaces, represents"),
    ("to and fro", "back and forth, one cycle"),
    ("leads astray", "misleads"),
    ("same bits as they are", "bit for bit unchanged"),
    ("brings up to", "updates to"),
    ("met in part", "partially fulfilled, in partial agreement"),
    ("by the thousand", "thousands of"),
    ("asks", "requires, requests, reads"),
    ("knows", "contains, stores, uses"),
    ("bears", "carries, supports"),
];
/// A line of a comment that begins so is a heading of its own: `# Errors`.
const ERRORS: (&str, &str) = ("Errors:", "the heading `# Errors`");

/// The list above is full of them.
const THIS_FILE: &str = "tests/tests/all/words.rs";

/// Consecutive words of one comment, string or document, each with its line; punctuation between words is a word too.
type Words = Vec<(usize, String)>;

/// Appends the words of a piece of text that begins in `line` (from 1).
fn append_words(words: &mut Words, text: &str, mut line: usize) {
    let mut word = String::new();
    for c in text.chars().chain([' ']) {
        if c.is_alphanumeric() || c == '_' || (c == '\'' && !word.is_empty()) {
            word.extend(c.to_lowercase());
            continue;
        }
        if !word.is_empty() {
            words.push((line, std::mem::take(&mut word).trim_end_matches('\'').to_owned()));
        }
        if ".,:;!?()|".contains(c) {
            words.push((line, c.to_string()));
        }
        line += usize::from(c == '\n');
    }
}

/// Comments and string literals of a Rust source; successive lines of comments are one text.
fn texts_of_rust(source: &str) -> Vec<Words> {
    let mut texts: Vec<Words> = Vec::new();
    let mut comment_until = None; // line up to which the last text is a comment
    let (mut rest, mut line) = (source, 1);
    let literal = |rest: &str| {
        let hashes = rest.strip_prefix('r').map(|r| r.len() - r.trim_start_matches('#').len());
        let (open, close) = match hashes {
            Some(n) if rest[1 + n..].starts_with('"') => (n + 2, format!("\"{}", "#".repeat(n))),
            _ if rest.starts_with('"') => (1, "\"".to_owned()),
            _ => return None,
        };
        let mut end = open;
        while !rest[end..].starts_with(&close) {
            let escape = hashes.is_none() && rest[end..].starts_with('\\');
            end += rest[end..].chars().take(1 + usize::from(escape)).map(char::len_utf8).sum::<usize>();
        }
        Some((open..end, end + close.len()))
    };
    let mut in_word = false;
    while let Some(c) = rest.chars().next() {
        let length = if rest.starts_with("//") {
            let end = rest.find('\n').unwrap_or(rest.len());
            let mut words = if comment_until == Some(line - 1) { texts.pop().unwrap_or_default() } else { Vec::new() };
            append_words(&mut words, &rest[2..end], line);
            texts.push(words);
            comment_until = Some(line);
            end
        } else if let Some((inside, length)) = (!in_word).then(|| literal(rest)).flatten() {
            let mut words = Vec::new();
            append_words(&mut words, &rest[inside].replace("\\n", "  ").replace('\\', " "), line);
            texts.push(words);
            comment_until = None;
            length
        } else if rest.starts_with("'\\") {
            // An escaped character, quotation marks among them.
            rest[3..].find('\'').map_or(1, |end| end + 4)
        } else if rest.starts_with("'\"'") {
            3
        } else {
            c.len_utf8()
        };
        in_word = c.is_alphanumeric() && (c != 'b' || in_word);
        line += rest[..length].matches('\n').count();
        rest = &rest[length..];
    }
    texts
}

/// Words that a line and the line below it may have.
fn allowed(source: &str) -> Vec<(usize, String)> {
    let mut found = Vec::new();
    for (i, line) in source.lines().enumerate() {
        let Some((_, list)) = line.split_once("words: allow ") else { continue };
        found.extend(list.split('"').skip(1).step_by(2).map(|word| (i + 1, word.to_lowercase())));
    }
    found
}

/// Where `source` has a word of the list that no comment allows, and comments that allow what is not there.
fn found(name: &str, source: &str) -> Vec<String> {
    let rust = name.ends_with(".rs");
    let texts = if rust {
        texts_of_rust(source)
    } else {
        let mut words = Vec::new();
        append_words(&mut words, source, 1);
        vec![words]
    };
    let mut hits: Vec<(usize, &str, &str)> = Vec::new();
    for (phrase, instead) in REPLACED {
        let phrase_words: Vec<&str> = phrase.split(' ').collect();
        for text in &texts {
            let same = |window: &&[(usize, String)]| window.iter().zip(&phrase_words).all(|(word, of)| word.1 == *of);
            let matches = text.windows(phrase_words.len()).filter(same);
            hits.extend(matches.map(|window| (window[0].0, phrase, instead)));
        }
    }
    for (i, line) in source.lines().enumerate().filter(|_| rust) {
        let line = line.trim_start();
        if line.starts_with("//") && line.trim_start_matches(['/', '!', ' ']).starts_with(ERRORS.0) {
            hits.push((i + 1, ERRORS.0, ERRORS.1));
        }
    }
    let allowed = allowed(source);
    let covers = |(at, word): &(usize, String), hit: &(usize, &str, &str)| {
        (*at == hit.0 || at + 1 == hit.0) && *word == hit.1.to_lowercase()
    };
    let mut lines: Vec<(usize, String)> = Vec::new();
    for hit in &hits {
        if !allowed.iter().any(|allowed| covers(allowed, hit)) {
            lines.push((hit.0, format!("\"{}\"; write: {}", hit.1, hit.2)));
        }
    }
    for (at, word) in &allowed {
        // The comment itself, where it is one of a source, is a hit too.
        let own = usize::from(texts.iter().flatten().any(|(line, text)| line == at && text == word));
        let covered = hits.iter().filter(|hit| covers(&(*at, word.clone()), hit)).count();
        if covered <= own {
            lines.push((*at, format!("\"{word}\" is allowed and not there; delete the comment")));
        }
    }
    lines.sort();
    lines.into_iter().map(|(line, text)| format!("{name}:{line}: {text}")).collect()
}

/// Endings of sources and documents that are looked through; of other languages than Rust, names in the code as well.
const TEXTS: [&str; 9] = [".rs", ".md", ".py", ".pyi", ".js", ".ts", ".c", ".h", ".cpp"];

/// Sources and documents below a folder of the repository, without builds and hidden folders.
fn files_below(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if path.is_symlink() || name.starts_with('.') || name == "target" || name == "shared" || name == "node_modules"
        {
            continue;
        } else if path.is_dir() {
            files_below(&path, found);
        } else if TEXTS.iter().any(|ending| name.ends_with(ending)) {
            found.push(path);
        }
    }
}

#[test]
fn documents_and_sources_are_in_plain_words() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let mut files = Vec::new();
    files_below(root, &mut files);
    files.sort();
    assert!(files.len() > 700, "only {} files are looked through", files.len());
    let mut lines = Vec::new();
    for file in files {
        let name = file.strip_prefix(root).unwrap();
        if name == Path::new(THIS_FILE) {
            continue;
        }
        lines.extend(found(&name.to_string_lossy(), &fs::read_to_string(&file).unwrap()));
    }
    assert!(lines.is_empty(), "{} places are not in plain words:\n{}", lines.len(), lines.join("\n"));
}

#[test]
fn a_planted_word_is_found_in_comments_and_strings_alone() {
    let source = "/// It is\n/// told.\nfn told() -> &'static str {\n    let c = '\"'; // to and\n    // fro\n    \
                  concat!(\"a \\\" \\\n  anew\", r#\"it \"asks\"\"#, br\"told\", 'a', '\\'', \"what. leaves\")\n}\n";
    let lines: Vec<String> = found("a.rs", source).iter().map(|l| l.split(';').next().unwrap().to_owned()).collect();
    let wanted = ["2: \"told\"", "4: \"to and fro\"", "7: \"anew\"", "7: \"asks\"", "7: \"told\""];
    assert_eq!(lines, wanted.map(|line| format!("a.rs:{line}")));
}

#[test]
fn errors_are_a_heading() {
    let lines = found("a.rs", "/// Reads.\n///\n/// Errors: a file that is missing.\nfn read() {}\n");
    assert_eq!(lines, ["a.rs:3: \"Errors:\"; write: the heading `# Errors`"]);
}

#[test]
fn a_comment_allows_a_word_beside_and_below_it() {
    assert_eq!(found("a.md", "<!-- words: allow \"bears\" -->\nBlack bears.\n"), Vec::<String>::new());
    assert_eq!(found("a.rs", "let a = \"bears\"; // words: allow \"bears\"\n"), Vec::<String>::new());
    assert_eq!(found("a.rs", "// words: allow \"bears\"\nlet a = \"bears\";\nlet b = \"bears\";\n").len(), 1);
    let unused = found("a.rs", "// words: allow \"bears\"\nlet a = 1;\n");
    assert_eq!(unused, ["a.rs:1: \"bears\" is allowed and not there; delete the comment"]);
}
