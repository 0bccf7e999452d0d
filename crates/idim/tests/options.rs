//! Options that leave each other nothing to do are refused by name, never dropped.
#![allow(clippy::unwrap_used)]

mod command;

use command::run;

/// Refused with each of these words, whatever the log: options are read before it.
#[track_caller]
fn refused(command: &str, options: &[&str], words: &[&str]) {
    let dir = tempfile::tempdir().unwrap();
    let robot = dir.path().join("arm.ron");
    std::fs::write(&robot, idim_fixtures::PLANAR2R).unwrap();
    let mut all = vec![command, "--robot", robot.to_str().unwrap()];
    all.extend(["--log", "no-such.csv"]);
    if command != "identify" {
        all.extend(["--loaded", "no-other.csv"]);
    }
    if command == "drive-gains" {
        all.extend(["--mass", "3"]);
    }
    all.extend(options);
    let message = run(&all).unwrap_err();
    for word in words {
        assert!(message.contains(word), "`{word}` is not in: {message}");
    }
}

#[test]
fn regress_filters_beside_data_as_recorded_are_refused() {
    for command in ["identify", "payload", "drive-gains"] {
        for filter in [
            &["--cutoff", "5"][..],
            &["--rate", "50"],
            &["--derive-velocity"],
        ] {
            let all = [&["--as-recorded"], filter].concat();
            refused(
                command,
                &all,
                &["--as-recorded and", filter[0], "leave out"],
            );
        }
    }
}

#[test]
fn regress_a_dead_band_is_one_speed_or_one_a_joint() {
    refused(
        "identify",
        &["--dead-band", "0.1,0.1,0.2"],
        &["--dead-band", "3 speeds for 2"],
    );
    refused(
        "payload",
        &["--dead-band", "1,2,3"],
        &["3 speeds for 2 joints"],
    );
}

#[test]
fn regress_columns_of_friction_beside_friction_are_refused() {
    let both = ["--columns", "rotor,viscous", "--friction", "auto"];
    refused(
        "identify",
        &both,
        &["--columns and --friction", "`viscous`", "rotor"],
    );
    // The rotor is no friction: this is read, and only the log is not there.
    let rotor = ["--columns", "rotor", "--friction", "auto"];
    refused("identify", &rotor, &["no-such.csv"]);
}

#[test]
fn regress_papers_take_no_option_of_logs() {
    for options in [
        &["puma", "--cutoff", "5"][..],
        &["crs-a460", "--mapping", "m.ron"],
        &["puma", "--friction", "auto"],
        &["puma", "--weighting", "full"],
        &["--waive", "gaps"],
        &["puma", "--lock", "a=1"],
        &["--essential"],
    ] {
        let all = [&["identify"], options].concat();
        let message = run(&all).unwrap_err();
        let option = options.iter().find(|o| o.starts_with("--")).unwrap();
        for word in [option, "paper", "--robot"] {
            assert!(message.contains(word), "`{word}` is not in: {message}");
        }
    }
}

#[test]
fn regress_only_what_the_doctor_can_say_is_waived() {
    refused(
        "identify",
        &["--waive", "torque-sing"],
        &["`torque-sing`", "torque-sign"],
    );
    refused(
        "payload",
        &["--waive", "gaps:wrist7"],
        &["--waive gaps:wrist7", "the joints are"],
    );
}

#[test]
fn identity_the_codes_are_those_of_the_page() {
    let page = include_str!("../../../docs/check.md");
    let rows = page.lines().filter(|l| l.starts_with("| `"));
    let cells = rows.filter_map(|l| l.split('|').nth(1));
    let mut written: Vec<&str> = cells
        .flat_map(|c| c.split('`').skip(1).step_by(2))
        .take_while(|c| *c != "schema")
        .collect();
    let mut known = idim::check::CODES.to_vec();
    written.sort_unstable();
    known.sort_unstable();
    assert_eq!(written, known);
}

#[test]
fn regress_gains_take_no_weights() {
    refused(
        "drive-gains",
        &["--robust", "huber"],
        &["drive-gains and --robust"],
    );
}
