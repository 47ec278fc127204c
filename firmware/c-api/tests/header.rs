//! The header is what cbindgen writes from the source, and C99 and C++ take it and the example.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot go on fails"
)]

use std::path::Path;
use std::process::Command;

const PACKAGE: &str = env!("CARGO_MANIFEST_DIR");
const HEADER: &str = "include/holdfast.h";
/// The files that hold what C sees, in the order of the header.
const SOURCES: [&str; 5] = ["numbers", "records", "provider", "captures", "table"];

fn fresh() -> String {
    let package = Path::new(PACKAGE);
    let config = cbindgen::Config::from_file(package.join("cbindgen.toml")).unwrap();
    let start = cbindgen::Builder::new().with_config(config);
    let builder = SOURCES.iter().fold(start, |builder, name| {
        builder.with_src(package.join(format!("src/{name}.rs")))
    });
    let mut bytes = Vec::new();
    builder.generate().unwrap().write(&mut bytes);
    String::from_utf8(bytes).unwrap()
}

#[test]
fn the_committed_header_is_what_cbindgen_writes() {
    let committed = std::fs::read_to_string(Path::new(PACKAGE).join(HEADER)).unwrap_or_default();
    let fresh = fresh();
    if committed != fresh {
        let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("holdfast.h");
        std::fs::write(&path, fresh).unwrap();
        panic!(
            "{HEADER} differs from the source; to take it over: cp {} {PACKAGE}/{HEADER}",
            path.display()
        );
    }
}

/// Compiles a file and says what the compiler said.
fn compiles(compiler: &str, language: &str, standard: &str, file: &Path) {
    let output = Command::new(compiler)
        .args(["-x", language, standard, "-pedantic-errors"])
        .args([
            "-Wall",
            "-Wextra",
            "-Wconversion",
            "-Werror",
            "-c",
            "-o",
            "/dev/null",
        ])
        .arg("-I")
        .arg(Path::new(PACKAGE).join("include"))
        .arg(file)
        .output()
        .unwrap_or_else(|error| panic!("{compiler}: {error}"));
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{compiler} {standard}: {said}");
}

#[test]
fn c99_and_cpp_take_the_header_and_the_example() {
    let folder = tempfile::tempdir().unwrap();
    let alone = folder.path().join("alone.c");
    std::fs::write(&alone, "#include \"holdfast.h\"\n").unwrap();
    let example = Path::new(PACKAGE).join("examples/limit_chain.c");
    for file in [alone, example] {
        for standard in ["-std=c99", "-std=c11"] {
            compiles("cc", "c", standard, &file);
        }
        for standard in ["-std=c++11", "-std=c++17"] {
            compiles("c++", "c++", standard, &file);
        }
    }
}

#[test]
fn a_file_that_is_not_c_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let wrong = folder.path().join("wrong.c");
    std::fs::write(
        &wrong,
        "#include \"holdfast.h\"\nholdfast_no_such_type x;\n",
    )
    .unwrap();
    let refused = std::panic::catch_unwind(|| compiles("cc", "c", "-std=c99", &wrong));
    assert!(refused.is_err());
}
