//! What Zephyr and ESP-IDF read, as far as it can be checked without them: the syntax of the YAML,
//! the files that it names, and which library the CMake files pick, with stand-ins for functions of
//! the two build systems.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot go on fails"
)]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use yaml_rust2::{Yaml, YamlLoader};

fn package() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn yaml(file: &str) -> Yaml {
    let text = fs::read_to_string(package().join(file)).unwrap();
    let mut documents = YamlLoader::load_from_str(&text).unwrap();
    assert_eq!(documents.len(), 1, "{file}");
    documents.remove(0)
}

#[test]
fn the_zephyr_module_names_files_that_are_there() {
    let module = yaml("zephyr/module.yml");
    assert_eq!(module["name"].as_str(), Some("holdfast"));
    let cmake = module["build"]["cmake"].as_str().unwrap();
    assert!(package().join(cmake).join("CMakeLists.txt").is_file());
    let kconfig = module["build"]["kconfig"].as_str().unwrap();
    let text = fs::read_to_string(package().join(kconfig)).unwrap();
    assert!(text.contains("\nconfig HOLDFAST\n"));
}

#[test]
fn the_component_has_a_version_and_targets() {
    let component = yaml("esp-idf/idf_component.yml");
    let version = component["version"].as_str();
    assert_eq!(version, Some(env!("CARGO_PKG_VERSION")));
    assert!(component["targets"].as_vec().is_some_and(|t| !t.is_empty()));
    assert!(component["dependencies"]["idf"].as_str().is_some());
}

/// Stand-ins: each prints what it was asked to link.
const STAND_INS: &str = "
function(zephyr_include_directories folder)
endfunction()
function(zephyr_library_import name file)
  message(STATUS \"links ${file}\")
endfunction()
function(idf_component_register)
endfunction()
function(add_prebuilt_library name file)
  message(STATUS \"links ${file}\")
endfunction()
function(target_link_libraries)
endfunction()
set(COMPONENT_LIB holdfast_component)
";

/// Runs a CMake file as a script with these settings; what it printed, or `None` where it stopped.
fn script(file: &str, settings: &[&str]) -> Option<String> {
    let folder = tempfile::tempdir().unwrap();
    let script = folder.path().join("script.cmake");
    let included = package().join(file);
    let text = format!("{STAND_INS}include(\"{}\")\n", included.display());
    fs::write(&script, text).unwrap();
    let output = Command::new("cmake")
        .args(settings.iter().map(|setting| format!("-D{setting}")))
        .arg("-P")
        .arg(&script)
        .output()
        .unwrap_or_else(|error| panic!("cmake: {error}"));
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    output.status.success().then_some(said)
}

/// Whether what was printed links the library of a target, from the folder that the file stands in.
fn links(said: &str, target: &str) -> bool {
    let end = Path::new("lib").join(target).join("libholdfast.a");
    said.lines().count() == 1 && said.trim_end().ends_with(&end.display().to_string())
}

#[test]
fn zephyr_links_the_library_of_the_core() {
    let file = "zephyr/CMakeLists.txt";
    let on = "CONFIG_HOLDFAST=y";
    let cases = [
        ("CONFIG_ARMV6_M_ARMV8_M_BASELINE=y", "thumbv6m-none-eabi"),
        ("CONFIG_FP_HARDABI=y", "thumbv7em-none-eabihf"),
        ("CONFIG_RISCV=y", "riscv32imc-unknown-none-elf"),
    ];
    for (core, target) in cases {
        let said = script(file, &[on, core]).unwrap();
        assert!(links(&said, target), "{core}: {said}");
        // Switched off it links nothing.
        assert_eq!(script(file, &[core]).as_deref(), Some(""));
    }
    assert_eq!(script(file, &[on, "CONFIG_ARM=y"]), None);
}

#[test]
fn esp_idf_links_the_library_for_risc_v_and_refuses_others() {
    let file = "esp-idf/CMakeLists.txt";
    let said = script(file, &["CONFIG_IDF_TARGET_ARCH_RISCV=y"]).unwrap();
    assert!(links(&said, "riscv32imc-unknown-none-elf"), "{said}");
    assert_eq!(script(file, &[]), None);
}
