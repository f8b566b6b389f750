//! Which device renders. The tests hold on machines with a GPU and on machines without one.

mod common;

use common::{Folder, ok, pullfocus, refused};
use std::fs;

const LENS: [&str; 8] =
    ["--focus-distance", "2", "--f-stop", "2", "--focal-length", "50", "--sensor-width", "36"];

fn json(text: &str) -> serde_json::Value {
    serde_json::from_str(text).unwrap()
}

/// The devices, as the program lists them.
fn devices() -> Vec<serde_json::Value> {
    json(&ok(pullfocus(["devices", "--json"])))["devices"].as_array().unwrap().clone()
}

#[test]
fn devices_are_listed_with_the_one_that_auto_takes() {
    let devices = devices();
    assert_eq!((&devices[0]["name"], &devices[0]["kind"]), (&"cpu".into(), &"cpu".into()));
    assert!(devices[0]["threads"].as_u64() >= Some(1) && devices[0]["instructions"].is_string());
    assert_eq!(devices.iter().filter(|device| device["auto"] == true).count(), 1);
    let table = ok(pullfocus(["devices"]));
    for device in &devices {
        let name = device["name"].as_str().unwrap();
        let line =
            table.lines().find(|line| line.starts_with(name)).unwrap_or_else(|| panic!("{name}: {table}"));
        assert_eq!(line.contains("auto takes it"), device["auto"] == true, "{line}");
        assert_eq!(line.contains("cannot be used"), device["usable"] == false, "{line}");
    }
}

#[test]
fn a_run_says_which_device_it_took() {
    let folder = Folder::new();
    let (input, output) = (folder.frame("in.exr", 1), folder.path("out.exr"));
    let render = |flags: &[&str]| {
        let arguments = ["render", &input, "-o", &output, "--overwrite"];
        ok(pullfocus([&arguments, &LENS[..], flags].concat()))
    };
    let text = render(&["--device", "cpu"]);
    assert_eq!(text.lines().next(), Some("device: cpu"), "{text}");
    assert_eq!(json(&render(&["--device", "cpu", "--json"]))["device"], "cpu");

    // Without a word it is the one that the list says, with a reason or an interface.
    let devices = devices();
    let auto = devices.iter().find(|device| device["auto"] == true).unwrap()["name"].as_str().unwrap();
    let text = render(&[]);
    let line = text.lines().next().unwrap();
    assert!(line.starts_with(&format!("device: {auto} (")), "{line}");
    let told = json(&render(&["--json"]))["device"].as_str().unwrap().to_owned();
    assert_eq!(line, format!("device: {told}"));
}

#[test]
fn the_cpu_renders_the_same_by_whatever_way_it_is_chosen() {
    let folder = Folder::new();
    let input = folder.frame("in.exr", 1);
    let settings = folder.path("shot.toml");
    fs::write(&settings, "device = 'cpu'").unwrap();
    let [by_flag, by_file] =
        [("flag.exr", ["--device", "cpu"]), ("file.exr", ["--config", settings.as_str()])].map(
            |(name, flags)| {
                let output = folder.path(name);
                let arguments = ["render", &input, "-o", &output, "--json"];
                let text = ok(pullfocus([&arguments, &LENS[..], &flags].concat()));
                let told = json(&text);
                assert_eq!(
                    (&told["device"], &told["frames"][0]["device"]),
                    (&"cpu".into(), &"cpu".into()),
                    "{name}"
                );
                fs::read(output).unwrap()
            },
        );
    assert!(by_flag == by_file);
}

#[test]
fn a_gpu_that_is_not_there_is_a_failure_that_lists_what_is() {
    let folder = Folder::new();
    let (input, output) = (folder.frame("in.exr", 1), folder.path("out.exr"));
    let render = |device: &str, json: &[&str]| {
        pullfocus([&["render", &input, "-o", &output, "--device", device], &LENS[..], json].concat())
    };
    let error = refused(1, render("gpu:no-such-thing", &[]));
    assert!(error.starts_with("pullfocus: error: ") && error.contains("'no-such-thing'"), "{error}");
    assert_eq!(error.trim_end().lines().count(), 1, "{error}");
    let devices = devices();
    for device in &devices {
        assert!(error.contains(device["name"].as_str().unwrap()), "{device}: {error}");
    }
    assert!(!folder.has("out.exr") && folder.leftovers() == 0);
    let (status, text, stderr) = render("gpu:no-such-thing", &["--json"]);
    assert_eq!(status, 1, "{stderr}");
    let told = json(&text);
    assert!(told["device"].is_null() && told["error"].as_str().unwrap().contains("no-such-thing"), "{told}");

    // Any GPU: a real one renders, and where there is none that is said.
    let real = |device: &serde_json::Value| {
        device["usable"] == true && device["kind"] != "cpu" && device["kind"] != "software"
    };
    match devices.iter().find(|device| real(device)) {
        Some(device) => {
            let text = ok(render("gpu", &[]));
            assert!(text.starts_with(&format!("device: {} (", device["name"].as_str().unwrap())), "{text}");
        }
        None => {
            let error = refused(1, render("gpu", &[]));
            assert!(error.contains("the devices are: cpu"), "{error}");
        }
    }
}

#[test]
fn what_names_no_device_is_a_mistake_of_usage() {
    let folder = Folder::new();
    let (input, output) = (folder.frame("in.exr", 1), folder.path("out.exr"));
    for device in ["gpu0", "gpu:", "CUDA", ""] {
        let error = refused(
            2,
            pullfocus([&["render", &input, "-o", &output, "--device", device], &LENS[..]].concat()),
        );
        assert!(error.contains("--device") && error.contains("gpu:NAME"), "{error}");
        let error = refused(2, pullfocus(["demo", "-o", &folder.path("demo"), "--device", device]));
        assert!(error.contains("gpu:NAME"), "{error}");
    }
    let settings = folder.path("shot.toml");
    fs::write(&settings, "f-stop = 2\ndevice = 'gpu0'").unwrap();
    let error = refused(2, pullfocus(["render", &input, "-o", &output, "--config", &settings]));
    assert!(error.contains("line 2") && error.contains("gpu:NAME"), "{error}");
    assert!(!folder.has("out.exr") && !folder.has("demo"));
}

#[test]
fn circles_are_the_cpus_work_whatever_the_settings_file_says() {
    let folder = Folder::new();
    let (input, output) = (folder.frame("in.exr", 1), folder.path("coc.png"));
    let settings = folder.path("shot.toml");
    fs::write(&settings, "device = 'gpu:no-such-thing'").unwrap();
    let arguments = ["coc", &input, "-o", &output, "--config", &settings, "--json"];
    assert_eq!(json(&ok(pullfocus([&arguments, &LENS[..]].concat())))["device"], "cpu");
    let error =
        refused(2, pullfocus([&["coc", &input, "-o", &output, "--device", "cpu"], &LENS[..]].concat()));
    assert!(error.contains("unexpected argument '--device'"), "{error}");
}

#[test]
fn the_demo_runs_on_the_device_that_was_chosen() {
    let folder = Folder::new();
    let out = folder.path("demo");
    let demo = ["demo", "-o", &out, "--preset", "preview", "--device"];
    let told = json(&ok(pullfocus([&demo[..], &["cpu", "--json"]].concat())));
    assert_eq!((&told["device"], told["frames"].as_array().unwrap().len()), (&"cpu".into(), 6));
    let text = ok(pullfocus([&demo[..], &["auto"]].concat()));
    assert_eq!(text.lines().filter(|line| line.starts_with("device: ")).count(), 1, "{text}");
    let error = refused(1, pullfocus([&demo[..], &["gpu:no-such-thing"]].concat()));
    assert!(error.contains("no-such-thing"), "{error}");
}
