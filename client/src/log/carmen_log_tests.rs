use super::*;
use toponym_proto::Limits;

fn log(text: &str) -> CarmenLog {
    CarmenLog::new(text.as_bytes().to_vec(), &Options::default(), Notes::default()).unwrap()
}

fn read(text: &str) -> (Vec<LogRecord>, Notes) {
    let mut log = log(text);
    let records = log.by_ref().collect();
    (records, log.notes().clone())
}

fn setup_laser(text: &str) -> Laser {
    let Some(Message::Setup(setup)) = log(text).next().map(|r| r.message) else { panic!("no setup") };
    setup.lasers[0].clone()
}

fn ahead(x_m: f64) -> Pose {
    Pose { x_m, ..Pose::default() }
}

fn kinds(records: &[LogRecord]) -> String {
    records
        .iter()
        .map(|r| match (&r.message, r.odom_row) {
            (Message::Setup(_), _) => 'S',
            (Message::Odom(_), true) => 'O',
            (Message::Odom(_), false) => 'o',
            (Message::Scan(_), _) => 'L',
            (Message::Say(_), _) => 'U',
            (Message::End(_), _) => 'E',
            (Message::Mend(_), _) => 'M',
        })
        .collect()
}

const SCAN_AT_1: &str = "FLASER 2 1 81.91 0.3 0 0 0 0 0 1 host 1\n";

#[test]
fn scans_bring_odometry_where_the_log_has_none() {
    let (records, notes) = read(&format!("{SCAN_AT_1}{}", SCAN_AT_1.replace(" 1 host", " 2.5 host")));
    assert_eq!(kinds(&records), "SOLOL");
    assert_eq!(records[3].stamp_text, "2.5");
    assert_eq!((notes.scans, notes.odoms, records[4].line), (2, 2, 2));
}

#[test]
fn odom_lines_are_the_rows_and_serve_scans_that_agree() {
    let odom = "ODOM 0 0 0 0 0 0 1 host 1\n";
    assert_eq!(kinds(&read(&format!("{odom}{SCAN_AT_1}")).0), "SOL");
    let moved = odom.replace("ODOM 0", "ODOM 0.5");
    assert_eq!(kinds(&read(&format!("{moved}{SCAN_AT_1}")).0), "SOoL");
    let earlier = odom.replace(" 1 host", " 0.9 host");
    assert_eq!(kinds(&read(&format!("{earlier}{SCAN_AT_1}")).0), "SOoL");
}

#[test]
fn headers_count_on_and_keep_the_stamps_as_they_come() {
    let back = "ODOM 0 0 0 0 0 0 2 h 1\nODOM 0 0 0 0 0 0 1.5 h 1\nODOM 0 0 0 0 0 0 1.5 h 1\n";
    let (records, _) = read(&format!("{back}{SCAN_AT_1}"));
    let headers: Vec<_> = records.iter().map(|r| r.message.header().unwrap()).collect();
    let seqs: Vec<u64> = headers.iter().map(|h| h.seq).collect();
    let stamps: Vec<f64> = headers.iter().map(|h| h.stamp.seconds()).collect();
    assert_eq!(seqs, (0..headers.len() as u64).collect::<Vec<_>>());
    assert_eq!(stamps, [2.0, 2.0, 1.5, 1.5, 1.0, 1.0]);
    assert!(headers.iter().all(|h| h.robot == "log" && h.boot == 0 && h.clock == Clock::Log));
}

#[test]
fn max_range_means_nothing_seen() {
    let (records, _) = read(SCAN_AT_1);
    let Message::Scan(scan) = &records[2].message else { panic!("{records:?}") };
    assert_eq!(scan.ranges_m, [1.0, f32::INFINITY]);
    assert_eq!(setup_laser(SCAN_AT_1), laser(ahead(0.3), 80.0));

    let short = format!("PARAM robot_front_laser_max 0.9\n{SCAN_AT_1}").replace("0.9", "1.0");
    assert_eq!(setup_laser(&short), laser(ahead(0.3), 1.0));
    let Message::Scan(scan) = &read(&short).0[2].message else { panic!("no scan") };
    assert_eq!(scan.ranges_m, [f32::INFINITY; 2]);
}

#[test]
fn mounting_comes_from_the_parameter_or_from_the_scans_two_poses() {
    let parameter = format!("PARAM robot_frontlaser_offset 0.27 1 h 1\n{SCAN_AT_1}");
    assert_eq!(setup_laser(&parameter), laser(ahead(0.27), 80.0));
    assert_eq!(setup_laser(SCAN_AT_1), laser(ahead(0.3), 80.0));
    // Facing +y the same offset lies along y.
    let turned = "FLASER 1 1 2 3.3 1.570796 2 3 1.570796 1 h 1\n";
    let laser = setup_laser(turned);
    assert!((laser.x_m - 0.3).abs() < 1e-6 && laser.y_m.abs() < 1e-6 && laser.yaw_rad.abs() < 1e-6);
}

#[test]
fn poses_of_a_corrected_log_are_no_mounting() {
    let corrected = format!("{SCAN_AT_1}FLASER 1 1 0.9 0.4 0.1 0 0 0 2 h 2\n");
    assert_eq!(setup_laser(&corrected), laser(ahead(0.0), 80.0));
    assert_eq!(setup_laser("FLASER 1 1 50 0 0 0 0 0 2 h 2\n"), laser(ahead(0.0), 80.0));
}

#[test]
fn a_bad_line_costs_that_line_only_and_is_named() {
    let text = format!("{SCAN_AT_1}FLASER 2 1 x 0 0 0 0 0 0 2 h 2\n\u{1}garbage\n{SCAN_AT_1}NEFF 3\n# c\n\n");
    let (records, mut notes) = read(&text);
    assert_eq!(kinds(&records), "SOLL");
    assert_eq!(notes.bad_lines, 2);
    notes.file = "a.log".into();
    let warnings = notes.warnings();
    assert!(warnings[0].starts_with("a.log:2: skipped: ranges: \"x\""), "{warnings:?}");
    assert!(warnings[2].ends_with("ignored 1 NEFF"), "{warnings:?}");
}

#[test]
fn what_a_server_refuses_is_a_bad_line_too() {
    let laser = "ROBOTLASER1 0 -1.5 3 STEP 80 0.01 0 2 1 1 0 0 0 0 0 0 0 0 0 0 0 0 2 h 2\n";
    let wide = |beams: usize| format!("FLASER {beams}{} 0 0 0 0 0 0 2 h 2\n", " 1".repeat(beams));
    for (line, why) in [
        ("ODOM 3e7 0 0 0 0 0 2 h 2\n".to_string(), "odom_from_body.x_m: is 30000000"),
        (laser.replace("STEP", "0"), "angle_increment_rad: is 0"),
        (wide(8193), "ranges_m: has 8193 entries"),
        (SCAN_AT_1.replace("0 0 0 1 host", "3e7 0 0 2 host"), "odom_from_body.x_m: is 30000000"),
    ] {
        let (records, notes) = read(&format!("{SCAN_AT_1}{line}ODOM 1 0 0 0 0 0 3 h 3\n{SCAN_AT_1}"));
        assert_eq!(kinds(&records), "SoLOoL", "{why}");
        let seqs: Vec<u64> = records.iter().map(|r| r.message.header().unwrap().seq).collect();
        assert_eq!(seqs, [0, 1, 2, 3, 4, 5]);
        assert!(records.iter().all(|r| r.message.validate(&Limits::default()).is_ok()));
        assert_eq!((notes.bad_lines, notes.first_bad[0].0), (1, 2), "{notes:?}");
        assert!(notes.first_bad[0].1.starts_with(why), "{notes:?}");
    }
    let good = read(&format!("{SCAN_AT_1}{}{}", laser.replace("STEP", "0.5"), wide(8192)));
    assert_eq!((good.1.bad_lines, good.1.scans), (0, 3), "{:?}", good.1);
}

#[test]
fn a_setup_that_a_server_refuses_is_an_error_that_names_the_file() {
    let text = format!("PARAM robot_frontlaser_offset 500 1 h 1\n{SCAN_AT_1}").into_bytes();
    let notes = Notes { file: "a.log".into(), ..Notes::default() };
    let error = CarmenLog::new(text, &Options::default(), notes).unwrap_err().to_string();
    assert!(error.starts_with("a.log: ") && error.contains("lasers[0].x_m: is 500"), "{error}");
}

#[test]
fn a_cut_last_line_is_a_remark_and_its_stamp_is_not_believed() {
    let cut = format!("{SCAN_AT_1}ODOM 1 2 3 0 0 0 97605");
    let (records, notes) = read(&cut);
    assert_eq!(kinds(&records), "SoL");
    assert_eq!(notes.bad_lines, 0);
    assert!(notes.remarks[0].contains("line 2, the last, is truncated"), "{notes:?}");
}

#[test]
fn a_last_line_without_a_break_is_read() {
    let (records, notes) = read(SCAN_AT_1.trim_end());
    assert_eq!(kinds(&records), "SOL");
    assert!(notes.remarks.is_empty());
}

#[test]
fn no_scan_is_an_error_that_names_file_and_line() {
    let notes = Notes { file: "a.log".into(), ..Notes::default() };
    let text = b"ODOM 0 0 0 0 0 0 1 h 1\nFLASER 2 1\n".to_vec();
    let error = CarmenLog::new(text, &Options::default(), notes).unwrap_err().to_string();
    assert!(error.starts_with("a.log: no usable scan in 2 lines; line 2: "), "{error}");
}

#[test]
fn raw_sweeps_alone_are_told() {
    let text = b"RAWLASER1 0 -1.57 3.14 0.0174 81 0.01 0 1 1 0 1 h 1\n".to_vec();
    let error = CarmenLog::new(text, &Options::default(), Notes::default()).unwrap_err().to_string();
    assert!(error.contains("1 lines are RAWLASER"), "{error}");
}

#[test]
fn parameters_tell_the_view_and_how_far_it_sees() {
    let scan = "FLASER 4 1 2 31 3 0 0 0 0 0 0 1 h 1\n";
    for view in ["270", "4.712388980384690"] {
        let params = format!(
            "PARAM laser_front_laser_fov {view} 1 h 1\nPARAM laser_front_laser_max_range 30 1 h 1\n\
             PARAM robot_front_laser_max 40 1 h 1\n"
        );
        let (records, _) = read(&format!("{params}{scan}"));
        let Message::Scan(scan) = &records.last().unwrap().message else { panic!("a scan") };
        assert!((scan.angle_min_rad.to_degrees() + 135.0).abs() < 1e-6, "{scan:?}");
        assert!((scan.angle_increment_rad.to_degrees() - 90.0).abs() < 1e-6, "{scan:?}");
        assert_eq!(scan.ranges_m, [1.0, 2.0, f32::INFINITY, 3.0]);
    }
}
