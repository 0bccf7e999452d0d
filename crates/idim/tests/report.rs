//! The report: one file, every picture drawn by a real browser, nothing but text from hostile names.
#![allow(clippy::unwrap_used)]

use idim::report_html::{CutoffCurve, ReportData, ReportedFinding, report_html};
use idim::{
    DownWeightedResult, DroppedResult, FrictionResult, FrictionTrial, Identification,
    IdentifyOptions, LoadedRobot, SamplingOptions, identify,
};
use idim_measurement::Measurements;
use idim_model::{DriveColumns, JointState, Model, Robot, inverse_dynamics, robot_from_ron};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Would run if any of it were taken for markup; each way out of an element that a name passes through.
const HOSTILE: &str = "</script><script>document.title='pwned'</script><img src=x onerror=document.title='pwned'>\"'&\u{1b}[2J";

/// A planar arm whose second joint has that name.
fn robot() -> Robot {
    let quoted = format!("{HOSTILE:?}");
    let robot = robot_from_ron(&idim_fixtures::PLANAR2R.replace("\"elbow\"", &quoted)).unwrap();
    robot.with_notes([NOTE.to_owned()])
}

/// What the robot file makes one wonder about.
const NOTE: &str = "the shoulder of this file is an odd one";

/// Two joints swinging at incommensurate rates, with friction and a ripple that no parameter explains.
fn log(robot: &Robot, file: &str) -> Measurements {
    let model = Model::new(robot);
    let parameters: Vec<f64> = (0..20)
        .map(|k| {
            if k % 10 == 9 {
                3.0
            } else {
                0.1 + 0.05 * f64::from(k % 7)
            }
        })
        .collect();
    let n = 3000;
    let time: Vec<f64> = (0..n).map(|k| 0.01 * f64::from(k)).collect();
    let wave = |t: f64, w: f64| {
        (
            0.8 * (w * t).sin(),
            0.8 * w * (w * t).cos(),
            -0.8 * w * w * (w * t).sin(),
        )
    };
    let (mut q, mut qd, mut qdd, mut torque) = (
        vec![vec![]; 2],
        vec![vec![]; 2],
        vec![vec![]; 2],
        vec![vec![]; 2],
    );
    for &t in &time {
        let motion = [wave(t, 2.1), wave(t, 3.7)];
        let state = JointState {
            q: motion.iter().map(|m| m.0).collect(),
            qd: motion.iter().map(|m| m.1).collect(),
            qdd: motion.iter().map(|m| m.2).collect(),
        };
        let rigid = inverse_dynamics(&model, &parameters, &state);
        for j in 0..2 {
            q[j].push(state.q[j]);
            qd[j].push(state.qd[j]);
            qdd[j].push(state.qdd[j]);
            torque[j].push(
                rigid[j] + 2.0 * state.qd[j] + 1.5 * state.qd[j].signum() + 0.2 * (91.0 * t).sin(),
            );
        }
    }
    Measurements {
        file: file.into(),
        joints: robot.joints().iter().map(|j| j.name.clone()).collect(),
        time,
        q,
        qd: Some(qd),
        qdd: Some(qdd),
        torque,
    }
}

fn found(robot: &Robot) -> Identification {
    let loaded = LoadedRobot {
        described: robot.clone(),
        robot: robot.clone(),
    };
    let options = IdentifyOptions {
        columns: DriveColumns::ALL,
        sampling: SamplingOptions {
            as_recorded: true,
            ..SamplingOptions::default()
        },
        seed: 1,
        ..IdentifyOptions::default()
    };
    identify(&loaded, vec![log(robot, HOSTILE)], Vec::new(), &options).unwrap()
}

/// A page with every part there is.
fn page() -> String {
    let robot = robot();
    let mut found = found(&robot);
    found.result.warnings.push(HOSTILE.into());
    let cutoff = CutoffCurve {
        cutoff: vec![2.0, 5.0, 10.0, 20.0],
        error: vec![0.2, 0.06, 0.05, 0.055],
        chosen: 10.0,
    };
    let finding = ReportedFinding {
        code: "standstill".into(),
        severity: "error, waived",
        grave: true,
        place: HOSTILE.into(),
        met: "12 % of the samples".into(),
        rule: "leave them out with --dead-band".into(),
    };
    let trial = |terms: &str, size, rms| FrictionTrial {
        terms: terms.into(),
        size,
        held_out_rms: rms,
    };
    found.result.friction = vec![FrictionResult {
        joint: HOSTILE.into(),
        chosen: "viscous, coulomb".into(),
        tried: vec![
            trial("viscous, coulomb", 2, Some(0.123)),
            trial("viscous, coulomb, stribeck:0.050", 3, None),
        ],
    }];
    found.result.baselines[0].name = HOSTILE.into();
    if let Some(estimate) = &mut found.result.estimate {
        estimate.dropped = vec![DroppedResult {
            name: HOSTILE.into(),
            value: 0.1,
            low: -0.2,
            high: 0.4,
            relative_std: None,
        }];
        estimate.down_weighted = vec![DownWeightedResult {
            log: HOSTILE.into(),
            from: 1.0,
            to: 1.25,
            joints: vec![2],
            lowest_weight: 0.1,
        }];
    }
    report_html(&ReportData {
        result: &found.result,
        robot: &robot,
        predictions: &found.predictions,
        logs: &found.logs,
        spectrum: Some(&found.spectrum),
        cutoff: Some(&cutoff),
        findings: Some(&[finding]),
        figures: &[],
        paper: None,
        command: "idim identify --robot arm.ron --log run.csv",
        settings: &[("robot file".into(), HOSTILE.into())],
    })
}

#[test]
fn regress_hostile_names_stay_text() {
    let page = page();
    // Two elements hold script of ours, the others numbers; none comes from a name.
    assert!(!page.contains("<img"), "markup from a name");
    assert!(!page.contains("<script>document"), "script from a name");
    assert!(!page.contains('\u{1b}'), "control character from a name");
    assert!(
        page.contains("&lt;img src=x") || page.contains("&#60;img src=x"),
        "the name itself is lost"
    );
}

#[test]
fn regress_what_was_tried_and_left_out_is_shown() {
    let page = page();
    for words in [
        "stribeck:0.050",
        "taken",
        "gravity alone, as identified",
        "as identified, torques filtered as for the fit",
        "Left out because the residual does not miss them",
        "Spans that lost their say",
        "error, waived",
        "Ia: rotor inertia seen at the joint",
    ] {
        assert!(page.contains(words), "`{words}` is not in the page");
    }
    assert_eq!(page.matches(NOTE).count(), 1, "a note is said once");
}

#[test]
fn identity_same_data_same_bytes() {
    assert_eq!(page(), page());
}

#[test]
fn regress_nothing_is_fetched() {
    // A reference within the page is no address.
    let page = page().replace("url(#", "");
    for word in ["http://", "https://", "src=\"", "@import", "url("] {
        let places = page.matches(word).count();
        // The name space of SVG is a name, not an address.
        let allowed = usize::from(word == "http://");
        assert!(
            places <= allowed,
            "{word} stands {places} times in the page"
        );
    }
}

/// The browser, where there is one.
fn chromium() -> Option<PathBuf> {
    let paths = std::env::var_os("PATH")?;
    ["chromium", "chromium-browser", "google-chrome"]
        .iter()
        .flat_map(|name| std::env::split_paths(&paths).map(move |p| p.join(name)))
        .find(|p| p.is_file())
}

/// Standard output and error of the browser on the page.
fn browse(browser: &Path, page: &Path, profile: &Path, arguments: &[&str]) -> (String, String) {
    let output = Command::new(browser)
        .args([
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--disable-dev-shm-usage",
            "--no-first-run",
        ])
        .args([
            "--enable-logging=stderr",
            "--virtual-time-budget=10000",
            "--hide-scrollbars",
        ])
        .arg(format!("--user-data-dir={}", profile.display()))
        .args(arguments)
        .arg(format!("file://{}", page.display()))
        .output()
        .unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (text(&output.stdout), text(&output.stderr))
}

#[test]
fn identity_a_browser_draws_every_picture() {
    let Some(browser) = chromium() else {
        eprintln!("skipped: no chromium here, so nobody looks at the report");
        return;
    };
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("report");
    std::fs::create_dir_all(&folder).unwrap();
    let (file, profile) = (folder.join("report.html"), tempfile::tempdir().unwrap());
    std::fs::write(&file, page()).unwrap();

    let (dom, log) = browse(&browser, &file, profile.path(), &["--dump-dom"]);
    let errors: Vec<&str> = log.lines().filter(|l| l.contains("CONSOLE")).collect();
    assert!(errors.is_empty(), "{errors:#?}");
    assert!(!dom.contains("<title>pwned"), "a name was run");
    assert!(!dom.contains("<img"), "a name became markup");
    let ids = [
        "torque-1",
        "torque-2",
        "friction-1",
        "friction-2",
        "spectrum",
        "cutoff",
    ];
    assert!(
        dom.contains(&format!("data-drawn=\"{}\"", ids.len())),
        "not every picture was drawn"
    );
    for id in ids {
        let figure = dom
            .split("<figure")
            .find(|f| f.contains(&format!(" id=\"{id}\"")))
            .and_then(|f| f.split("</figure>").next())
            .unwrap();
        let curves = figure.matches(" d=\"M").count();
        assert!(curves > 5, "{id}: {curves} paths");
        assert!(
            !figure.contains("NaN") && !figure.contains("Infinity"),
            "{id}: a coordinate is not a number"
        );
        for axis in ["class=\"axis\"", "class=\"tick\"", "aria-label="] {
            assert!(figure.contains(axis), "{id}: no {axis}");
        }
    }

    for (name, more) in [
        ("light", "--blink-settings=preferredColorScheme=1"),
        ("dark", "--blink-settings=preferredColorScheme=0"),
    ] {
        let picture = folder.join(format!("{name}.png"));
        let shot = format!("--screenshot={}", picture.display());
        browse(
            &browser,
            &file,
            profile.path(),
            &[&shot, "--window-size=1100,5200", more],
        );
        let size = std::fs::metadata(&picture).unwrap().len();
        assert!(
            size > 50_000,
            "{name}: a picture of {size} bytes shows nothing"
        );
        eprintln!("screenshot: {}", picture.display());
    }
}
