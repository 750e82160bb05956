//! Layout of the text that `--help` prints below the options of a command.
//!
//! Main function: [`laid_out`]. The texts are next to their commands: a block of examples, then paragraphs. Paragraphs
//! become one line each, which clap breaks at the width of the terminal. Examples are laid out for [`WIDTH`] columns; a
//! longer one continues behind a backslash as in a shell.

use clap::Command;

/// Columns that examples keep to, as every terminal has them.
const WIDTH: usize = 80;
/// Before the rest of an example, and before a remark that does not fit beside it.
const INDENT: &str = "      ";

/// The command with the texts below the options of all its subcommands laid out.
pub fn laid_out(command: Command) -> Command {
    let names: Vec<String> = command.get_subcommands().map(|c| c.get_name().to_owned()).collect();
    names.into_iter().fold(command, |command, name| {
        command.mut_subcommand(name, |of| {
            let of = laid_out(of);
            match of.get_after_help().map(ToString::to_string) {
                Some(text) => of.after_help(blocks(&text)),
                None => of,
            }
        })
    })
}

fn blocks(text: &str) -> String {
    let block = |block: &str| match block.split_once('\n') {
        Some(("Examples:", examples)) => format!("Examples:\n{}", lines(examples)),
        _ => block.split('\n').map(str::trim).collect::<Vec<_>>().join(" "),
    };
    text.split("\n\n").map(block).collect::<Vec<_>>().join("\n\n")
}

/// Example lines: a command, and behind two spaces a remark, which may be in the next line. If one is too long, all
/// remarks are below their commands.
fn lines(examples: &str) -> String {
    if examples.lines().all(|line| line.chars().count() <= WIDTH) {
        return examples.to_owned();
    }
    let mut out: Vec<String> = Vec::new();
    for line in examples.lines() {
        let (command, remark) = match line.trim().split_once("  ") {
            _ if line.starts_with("   ") => ("", line.trim()),
            Some((command, remark)) => (command, remark.trim()),
            None => (line.trim(), ""),
        };
        if !command.is_empty() {
            out.extend(broken(command));
        }
        if !remark.is_empty() {
            out.push(format!("{INDENT}{remark}"));
        }
    }
    out.join("\n")
}

/// A command in lines of at most [`WIDTH`] columns.
fn broken(command: &str) -> Vec<String> {
    let mut lines = vec!["  ".to_owned()];
    for word in command.split(' ') {
        let line = lines.last_mut().expect("one line at least");
        let is_first = line.trim().is_empty();
        // The backslash needs two columns.
        if !is_first && line.chars().count() + 1 + word.chars().count() + 2 > WIDTH {
            line.push_str(" \\");
            lines.push(format!("{INDENT}{word}"));
        } else {
            if !is_first {
                line.push(' ');
            }
            line.push_str(word);
        }
    }
    lines
}
