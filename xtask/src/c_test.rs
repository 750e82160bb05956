//! The C library's release folder as its users meet it: in a folder outside the repository, with their tools.
//!
//! Main function: [`test()`]. Uses `c_release` for the folder and `install` for what is missing.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result, bail, ensure};

use crate::thumb::tools::{C_LIBRARY, cargo_command};
use crate::{c_release, install, root, run};

mod packages;

const MODEL: &str = "data/models/fingertip.fpm";
const CORRECTED: &str = "firmware-example/corrected.fpm";
const DOCUMENT: &str = "core/docs/fpm-format.md";
/// The page whose C program is compiled and run.
const PAGE: &str = "docs/my-c-program.md";
/// The programs of the consumer, each as C99 and as C++17.
const LANGUAGES: [&str; 2] = ["", "_cpp"];

/// A copy of the release and a project that builds on it.
struct Consumer {
    release: PathBuf,
    source: PathBuf,
    build: PathBuf,
    story: PathBuf,
}

/// Makes the release folder and checks all of it that runs on a host.
pub fn test() -> Result<()> {
    prepare()?;
    let folder = tempfile::tempdir()?;
    let consumer = Consumer::new(folder.path())?;
    consumer.configure_and_build("plain", &["-DCMAKE_BUILD_TYPE=Release"])?;
    consumer.vectors_and_story()?;
    consumer.configure_and_build("sanitized", &["-DCMAKE_BUILD_TYPE=Debug", "-DSANITIZE=ON"])?;
    consumer.vectors_and_story()?;
    consumer.misuse()?;
    consumer.refuses_another_version_and_processor()?;
    consumer.installed_with_pkg_config(&folder.path().join("prefix"))?;
    consumer.page(folder.path())?;
    consumer.page_in_cpp(folder.path())?;
    packages::check(&consumer.release, folder.path())
}

/// CMake, pkg-config, a C and a C++ compiler, GCC for Cortex-M.
pub fn prepare() -> Result<()> {
    let tools = [
        ("cmake", "cmake"),
        ("pkg-config", "pkg-config"),
        ("gcc", "gcc"),
        ("g++", "g++"),
        ("make", "make"),
        ("arm-none-eabi-gcc", "gcc-arm-none-eabi"),
    ];
    let missing: Vec<&str> = tools
        .into_iter()
        .filter(|(command, _)| !install::succeeds(Command::new(command).arg("--version")))
        .map(|(_, package)| package)
        .collect();
    if missing.is_empty() {
        return Ok(());
    }
    install::debian(&missing, &format!("apt-get install {}", missing.join(" ")))
}

/// Writes the story and what the core answers to it into `folder`.
pub fn tell_story(folder: &Path) -> Result<()> {
    let tell = ["run", "--quiet", "--release", "--package", "fingerpad-story", "--"];
    let mut cargo = cargo_command();
    cargo.current_dir(root().join(C_LIBRARY)).args(tell);
    for file in [MODEL, CORRECTED] {
        cargo.arg(fs::canonicalize(root().join(file))?);
    }
    run(cargo.arg(folder))
}

impl Consumer {
    fn new(folder: &Path) -> Result<Self> {
        let header = fs::read_to_string(root().join(C_LIBRARY).join("fingerpad.h"))?;
        let consumer = Self {
            release: folder.join("release"),
            source: folder.join("consumer"),
            build: folder.join("plain"),
            story: folder.join("story"),
        };
        c_release::release(&consumer.release)?;
        let written = fs::read_to_string(consumer.release.join("include/fingerpad.h"))?;
        ensure!(
            header == written,
            "{C_LIBRARY}/fingerpad.h was not up to date with the library; now it is: look at it"
        );
        copy_folder(&root().join(C_LIBRARY).join("consumer"), &consumer.source)?;
        fs::create_dir(&consumer.story)?;
        tell_story(&consumer.story)?;
        Ok(consumer)
    }

    fn configure_and_build(&self, name: &str, options: &[&str]) -> Result<()> {
        let build = self.build.with_file_name(name);
        run(self.cmake(&build).args(options))?;
        run(Command::new("cmake").arg("--build").arg(&build).args(["--parallel", "2"]))?;
        if build != self.build {
            // The programs are found where the first build left them.
            fs::remove_dir_all(&self.build)?;
            fs::rename(&build, &self.build)?;
        }
        Ok(())
    }

    fn cmake(&self, build: &Path) -> Command {
        let mut cmake = Command::new("cmake");
        cmake.arg("-S").arg(&self.source).arg("-B").arg(build);
        cmake.arg(format!("-DCMAKE_PREFIX_PATH={}", self.release.display()));
        cmake
    }

    fn program(&self, name: &str, language: &str) -> Command {
        Command::new(self.build.join(format!("{name}{language}")))
    }

    /// The documented vectors, and every answer of the story, bit for bit.
    fn vectors_and_story(&self) -> Result<()> {
        for language in LANGUAGES {
            run(self.program("vectors", language).arg(root().join(MODEL)).arg(root().join(DOCUMENT)))?;
            let charged = self.story.join("charged.fpm");
            let shipped = root().join(MODEL);
            let answers = self.answers(language, &shipped, &charged)?;
            let wanted = fs::read_to_string(self.story.join("answers.txt"))?;
            compare(&fs::read_to_string(self.story.join("story.txt"))?, &wanted, &answers)?;
            ensure!(
                self.answers(language, &charged, &shipped)? != wanted,
                "the comparison does not see that the models were exchanged"
            );
        }
        println!("C: every answer of the story bit for bit, as C99 and as C++17");
        Ok(())
    }

    fn answers(&self, language: &str, model: &Path, charged: &Path) -> Result<String> {
        let story = File::open(self.story.join("story.txt"))?;
        let mut program = self.program("story", language);
        let out = program.arg(model).arg(charged).stdin(story).output()?;
        ensure!(out.status.success(), "story{language}: {}", String::from_utf8_lossy(&out.stderr));
        Ok(String::from_utf8(out.stdout)?)
    }

    fn misuse(&self) -> Result<()> {
        for language in LANGUAGES {
            run(self.program("roll_on_ball", language).arg(self.release.join("share/fingerpad/fingertip-pad.fpm")))?;
            let charged = self.story.join("charged.fpm");
            run(self.program("misuse", language).arg(root().join(MODEL)).arg(charged))?;
        }
        let pad = self.release.join("share/fingerpad/fingertip-pad.fpm");
        run(self.program("wrapper", "").arg(root().join(MODEL)).arg(pad))
    }

    /// The configuration of a project fails if it requires a version or a processor that is not there.
    fn refuses_another_version_and_processor(&self) -> Result<()> {
        let lists = self.source.join("CMakeLists.txt");
        let text = fs::read_to_string(&lists)?;
        let refused = |options: &[&str], part: &str| -> Result<()> {
            let build = self.build.with_file_name("refused");
            let out = self.cmake(&build).args(options).stdin(Stdio::null()).output()?;
            // CMake breaks its messages into lines.
            let says = String::from_utf8_lossy(&out.stderr).split_whitespace().collect::<Vec<_>>().join(" ");
            fs::remove_dir_all(&build)?;
            ensure!(!out.status.success() && says.contains(part), "CMake should have refused {options:?}: {says}");
            Ok(())
        };
        refused(&["-DFINGERPAD_TARGET=avr-none"], "no library for 'avr-none'")?;
        fs::write(&lists, text.replace("fingerpad 0.1", "fingerpad 9.0"))?;
        refused(&[], "requested version \"9.0\"")?;
        fs::write(&lists, text)?;
        Ok(())
    }

    /// The folder installed by CMake, then found by pkg-config alone.
    fn installed_with_pkg_config(&self, prefix: &Path) -> Result<()> {
        let build = self.build.with_file_name("installing");
        run(Command::new("cmake").arg("-S").arg(&self.release).arg("-B").arg(&build))?;
        run(Command::new("cmake").arg("--install").arg(&build).arg("--prefix").arg(prefix))?;
        let asked = Command::new("pkg-config")
            .env("PKG_CONFIG_PATH", prefix.join("lib/pkgconfig"))
            .args(["--cflags", "--libs", "fingerpad >= 0.1"])
            .output()?;
        ensure!(asked.status.success(), "pkg-config: {}", String::from_utf8_lossy(&asked.stderr));
        let flags = String::from_utf8(asked.stdout)?;
        let program = prefix.join("vectors");
        let mut gcc = Command::new("gcc");
        gcc.arg("-std=c99").arg(self.source.join("vectors.c")).args(flags.split_whitespace());
        run(gcc.arg("-o").arg(&program))?;
        run(Command::new(&program).arg(root().join(MODEL)).arg(root().join(DOCUMENT)))
    }

    /// The page's program and the shipped example, compiled as the page says.
    fn page(&self, folder: &Path) -> Result<()> {
        let page = fs::read_to_string(root().join(PAGE))?;
        let source = block(&page, "```c\n").with_context(|| format!("{PAGE} has no C program"))?;
        let shipped = self.release.join("examples/press_and_slide.c");
        let mine = folder.join("mine.c");
        fs::write(&mine, source)?;
        for source in [mine, shipped] {
            let program = source.with_extension("");
            let library = self.release.join("lib/fingerpad").join(c_release::host()?).join("libfingerpad.a");
            let mut gcc = Command::new("gcc");
            gcc.args(["-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "-I"]).arg(self.release.join("include"));
            run(gcc.arg(&source).arg(library).arg("-o").arg(&program))?;
            let out = Command::new(&program).output()?;
            let says = String::from_utf8_lossy(&out.stdout);
            print!("{says}");
            ensure!(out.status.success() && says.contains("slip"), "{} does not report slip", source.display());
        }
        Ok(())
    }

    /// The page's C++20 program, compiled as the page says; its friction is that of the C program.
    fn page_in_cpp(&self, folder: &Path) -> Result<()> {
        let page = fs::read_to_string(root().join(PAGE))?;
        let source = folder.join("mine.cpp");
        fs::write(&source, block(&page, "```cpp\n").with_context(|| format!("{PAGE} has no C++ program"))?)?;
        let object = folder.join("mine_cpp.o");
        let mut compile = Command::new("g++");
        compile.args(["-std=c++20", "-Wall", "-Wextra", "-Werror", "-fno-exceptions", "-fno-rtti", "-I"]);
        run(compile.arg(self.release.join("include")).arg("-c").arg(&source).arg("-o").arg(&object))?;
        let imported = Command::new("nm").args(["--undefined-only", "--format=just-symbols"]).arg(&object).output()?;
        let imported = String::from_utf8(imported.stdout)?;
        ensure!(imported.contains("fingerpad_step"), "nm does not list the imports of {}", object.display());
        let foreign: Vec<&str> = imported.lines().filter(|name| !is_expected_import(name)).collect();
        ensure!(foreign.is_empty(), "the wrapper imports {foreign:?}, for example of a heap or of exceptions");
        let program = folder.join("mine_cpp");
        let library = self.release.join("lib/fingerpad").join(c_release::host()?).join("libfingerpad.a");
        run(Command::new("g++").arg(&object).arg(library).arg("-o").arg(&program))?;
        let friction = |program: &Path| -> Result<Vec<String>> {
            let out = Command::new(program).output()?;
            ensure!(out.status.success(), "{}: {}", program.display(), out.status);
            let says = String::from_utf8(out.stdout)?;
            Ok(says.lines().filter_map(|line| line.split_whitespace().nth(1).map(str::to_owned)).collect())
        };
        let (c, cpp) = (friction(&folder.join("mine"))?, friction(&program)?);
        ensure!(c.len() == 10 && c == cpp, "the page's programs differ: in C {c:?}, in C++ {cpp:?}");
        println!("C++20: the page's program gives the friction of the page's C program");
        Ok(())
    }
}

/// Whether a program of the C++20 wrapper may import this: the library, the C library's output and memory functions.
fn is_expected_import(name: &str) -> bool {
    const C_LIBRARY_NAMES: [&str; 7] =
        ["printf", "puts", "memcpy", "memset", "memmove", "__stack_chk_fail", "_GLOBAL_OFFSET_TABLE_"];
    name.starts_with("fingerpad_") || C_LIBRARY_NAMES.contains(&name)
}

/// The first difference between two lists of answers.
fn compare(story: &str, wanted: &str, answers: &str) -> Result<()> {
    for (i, (want, got)) in wanted.lines().zip(answers.lines()).enumerate() {
        if want != got {
            bail!("request {i} ({}):\nthe core {want}\nC        {got}", story.lines().nth(i).unwrap_or_default());
        }
    }
    let (wanted, got) = (wanted.lines().count(), answers.lines().count());
    ensure!(wanted == got, "{got} answers to {wanted} requests");
    Ok(())
}

/// The first fenced block that starts so.
pub fn block<'a>(page: &'a str, fence: &str) -> Option<&'a str> {
    let (_, rest) = page.split_once(fence)?;
    Some(rest.split_once("```")?.0)
}

/// Copies the files of a folder, which has no folders in it.
pub fn copy_folder(from: &Path, to: &Path) -> Result<()> {
    fs::create_dir_all(to)?;
    for entry in fs::read_dir(from)? {
        let entry = entry?;
        fs::copy(entry.path(), to.join(entry.file_name()))?;
    }
    Ok(())
}
