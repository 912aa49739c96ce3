//! The program's answers against ground truth: 24 cameras whose rays were traced through an ideal thin lens in
//! 60-digit arithmetic, apart from this project (`tests/data/optics.json`).
//!
//! Planes and lines are compared up to sign and scale-free, about the true lens centre in units of the focal
//! length; matrices by projecting points. Matrices are applied in 200-bit arithmetic, so their rounding alone
//! is judged. The file's tolerances are used as they are, plus [`rounding`]: its numbers have 20 digits and are
//! read to the nearest f64 here.

#[path = "common/program.rs"]
mod program;

use dashu_float::FBig;
use serde_json::Value;

type Big = FBig;

fn big(value: f64) -> Big {
    Big::try_from(value).expect("finite").with_precision(200).value()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("not a number: {value}"))
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap_or_else(|| panic!("not an array: {value}")).iter().map(number).collect()
}

fn norm(v: &[f64]) -> f64 {
    let scale = v.iter().fold(0.0f64, |most, x| most.max(x.abs()));
    if scale == 0.0 { 0.0 } else { scale * v.iter().map(|x| (x / scale) * (x / scale)).sum::<f64>().sqrt() }
}

/// The distance of two vectors made unit, up to sign.
fn up_to_sign(a: &[f64], b: &[f64]) -> f64 {
    let (na, nb) = (norm(a), norm(b));
    let gap = |sign: f64| norm(&a.iter().zip(b).map(|(x, y)| x / na - sign * y / nb).collect::<Vec<_>>());
    gap(1.0).min(gap(-1.0))
}

fn dot(a: &[f64], b: &[f64]) -> Big {
    a.iter().zip(b).fold(big(0.0), |sum, (x, y)| sum + big(*x) * big(*y))
}

fn cross(a: &[f64], b: &[f64]) -> [Big; 3] {
    let term = |i: usize, j: usize| big(a[i]) * big(b[j]) - big(a[j]) * big(b[i]);
    [term(1, 2), term(2, 0), term(0, 1)]
}

/// A plane about the lens centre `c`, its distance in focal lengths.
fn plane(p: &[f64], c: &[f64], f: f64) -> [f64; 4] {
    let e = (big(p[3]) + dot(&p[..3], c)).to_f64().value() / f;
    [p[0], p[1], p[2], e]
}

/// A line about the lens centre, its moment in focal lengths.
fn line(l: &Value, c: &[f64], f: f64) -> [f64; 6] {
    let (d, m) = (numbers(&l["direction"]), numbers(&l["moment"]));
    let shift = cross(c, &d);
    let moment = [0, 1, 2].map(|i| (big(m[i]) - shift[i].clone()).to_f64().value() / f);
    [d[0], d[1], d[2], moment[0], moment[1], moment[2]]
}

/// What reading a plane or line of the file to the nearest f64 can change in these measures.
fn rounding(c: &[f64], f: f64) -> f64 {
    8.0 * f64::EPSILON * (1.0 + norm(c) / f)
}

/// The findings of one case, and the largest error as a share of what is allowed.
#[derive(Default)]
struct Judge {
    wrong: Vec<String>,
    worst: f64,
}

impl Judge {
    fn need(&mut self, what: &str, error: f64, allowed: f64) {
        if allowed > 0.0 {
            self.worst = self.worst.max(error / allowed);
        }
        if error.is_nan() || error > allowed {
            self.wrong.push(format!("{what} off by {error:.3e}, allowed {allowed:.3e}"));
        }
    }

    fn vectors(&mut self, what: &str, got: &Value, want: &Value, allowed: f64) {
        let gap: Vec<f64> = numbers(got).iter().zip(numbers(want)).map(|(a, b)| a - b).collect();
        self.need(what, norm(&gap), allowed);
    }

    fn numbers(&mut self, got: &Value, want: &Value, tolerance: &Value) {
        let relative = [
            ("lens", "focal_length"),
            ("lens", "aperture_diameter"),
            ("film", "width"),
            ("film", "height"),
            ("dof", "circle_of_confusion"),
        ];
        let movements = ["front", "rear"].into_iter().flat_map(|s| [(s, "rise_mm"), (s, "shift_mm")]);
        for (table, key) in relative.into_iter().chain(movements) {
            let (a, b) = (number(&got[table][key]), number(&want[table][key]));
            self.need(&format!("{table}.{key}"), (a - b).abs(), 1e-12 * b.abs());
        }
        for standard in ["front", "rear"] {
            for key in ["tilt_deg", "swing_deg"] {
                let (a, b) = (number(&got[standard][key]), number(&want[standard][key]));
                self.need(&format!("{standard}.{key}"), (a - b).abs(), number(&tolerance["angles_deg"]));
            }
        }
        for (table, key, allowed) in [
            ("lens", "center", "lens_center_m"),
            ("film", "center", "film_center_m"),
            ("lens", "axis", "axes"),
            ("lens", "ex", "axes"),
            ("lens", "ey", "axes"),
            ("film", "normal", "axes"),
            ("film", "fx", "axes"),
            ("film", "fy", "axes"),
        ] {
            let what = format!("{table}.{key}");
            self.vectors(&what, &got[table][key], &want[table][key], number(&tolerance[allowed]));
        }
        let gap = (number(&got["extension_mm"]) - number(&want["extension_mm"])).abs();
        self.need("extension_mm", gap, number(&tolerance["extension_mm"]));
    }

    fn planes_and_lines(&mut self, got: &Value, want: &Value, tolerance: &Value) {
        let (c, f) = (numbers(&want["lens"]["center"]), number(&want["lens"]["focal_length"]));
        let slack = rounding(&c, f);
        for (name, at) in [
            ("focus_plane", "/focus_plane"),
            ("dof.near_plane", "/dof/near_plane"),
            ("dof.far_plane", "/dof/far_plane"),
        ] {
            let (a, b) = (numbers(got.pointer(at).unwrap()), numbers(want.pointer(at).unwrap()));
            let length = norm(&a[..3]);
            let unit = if length == 0.0 { a[3].abs() } else { length };
            self.need(&format!("{name} scale"), (unit - 1.0).abs(), 1e-9);
            let gap = up_to_sign(&plane(&a, &c, f), &plane(&b, &c, f));
            self.need(name, gap, number(&tolerance[name]) + slack);
        }
        for name in ["scheimpflug_line", "hinge_line"] {
            let (a, b) = (&got[name], &want[name]);
            let length = norm(&numbers(&a["direction"]));
            let unit = if length == 0.0 { norm(&numbers(&a["moment"])) } else { length };
            self.need(&format!("{name} scale"), (unit - 1.0).abs(), 1e-9);
            let gap = up_to_sign(&line(a, &c, f), &line(b, &c, f));
            self.need(name, gap, number(&tolerance[name]) + slack);
        }
        match (got["hinge_distance"].as_f64(), want["hinge_distance"].as_f64()) {
            (None, None) => {}
            (Some(h), None) if h > 1e9 * f => {}
            (Some(h), Some(w)) => {
                self.need("hinge_distance", (h / w - 1.0).abs(), number(&tolerance["hinge_distance_rel"]));
            }
            (h, w) => self.wrong.push(format!("hinge_distance {h:?}, not {w:?}")),
        }
    }

    fn projections(&mut self, got: &Value, case: &Value) {
        let film = &case["optics"]["film"];
        let half = [0.5e3 * number(&film["width"]), 0.5e3 * number(&film["height"])];
        let size = numbers(&case["size_px"]);
        let near = number(&case["near_m"]);
        let sample = |u: f64, v: f64| {
            let list = got["sample_matrices"].as_array().unwrap();
            let same = |m: &&Value| (number(&m["u"]) - u).abs() + (number(&m["v"]) - v).abs() <= 1e-9;
            numbers(&list.iter().find(same).unwrap_or_else(|| panic!("no matrix for {u},{v}"))["matrix"])
        };
        for want in case["projections"].as_array().unwrap() {
            let (u, v) = (number(&want["u"]), number(&want["v"]));
            let mut point = numbers(&want["world_point_m"]);
            point.push(1.0);
            let label = format!("{} [{u},{v}]", want["what"].as_str().unwrap());
            let mut matrices = vec![sample(u, v)];
            if (u, v) == (0.0, 0.0) {
                matrices.push(numbers(&got["pinhole_matrix"]));
            }
            for matrix in matrices {
                let [x, y, z, w] = [0, 1, 2, 3].map(|row| dot(&matrix[4 * row..4 * row + 4], &point));
                let gap = |a: &Big, b: f64| (a.clone() - big(b)).to_f64().value().abs();
                self.need(&format!("w_s, {label}"), gap(&w, number(&want["w_s"])), number(&want["tol_w"]));
                self.need(&format!("clip z, {label}"), gap(&z, near), 1e-9 * near);
                let at = [-(x / w.clone()) * big(half[0]), -(y / w) * big(half[1])];
                let allowed = number(&want["tol_film_mm"]);
                let film_mm = numbers(&want["film_mm"]);
                let pixel = numbers(&want["pixel"]);
                for i in 0..2 {
                    let read = f64::EPSILON * film_mm[i].abs();
                    self.need(&format!("film {i} mm, {label}"), gap(&at[i], film_mm[i]), allowed + read);
                    // Pixels run against film x, and with film y.
                    let side = if i == 0 { -at[i].clone() } else { at[i].clone() };
                    let place = (side / big(2.0 * half[i]) + big(0.5)) * big(size[i]) - big(0.5);
                    let most = allowed / (2.0 * half[i]) * size[i] + pixel[i].abs() * 1e-12 + 1e-12;
                    self.need(&format!("pixel {i}, {label}"), gap(&place, pixel[i]), most);
                }
            }
            if (u, v) == (0.0, 0.0) && !want["blur"].is_null() {
                let columns = [sample(0.0, 0.0), sample(1.0, 0.0), sample(0.0, 1.0)]
                    .map(|matrix| [0, 1, 3].map(|row| dot(&matrix[4 * row..4 * row + 4], &point)));
                self.blur(&label, columns, half, want);
            }
        }
    }

    /// The axes of the conic that the aperture's disk is imaged to: columns at the centre and at two rim points.
    fn blur(&mut self, label: &str, columns: [[Big; 3]; 3], half: [f64; 2], want: &Value) {
        let [c0, cu, cv] = columns;
        // About the image of the lens centre, film millimetres.
        let (px, py) = (c0[0].clone() / c0[2].clone(), c0[1].clone() / c0[2].clone());
        let column = |c: &[Big; 3]| {
            [
                (px.clone() * c[2].clone() - c[0].clone()) * big(half[0]),
                (py.clone() * c[2].clone() - c[1].clone()) * big(half[1]),
                c[2].clone(),
            ]
        };
        let (c0, cu, cv) = (column(&c0), column(&cu), column(&cv));
        let less = |c: &[Big; 3]| [0, 1, 2].map(|i| c[i].clone() - c0[i].clone());
        let (cu, cv) = (less(&cu), less(&cv));
        let d = |i: usize, j: usize| {
            cu[i].clone() * cu[j].clone() + cv[i].clone() * cv[j].clone() - c0[i].clone() * c0[j].clone()
        };
        let k = d(2, 2);
        if k >= big(0.0) {
            self.wrong.push(format!("blur is no ellipse, {label}"));
            return;
        }
        let over = |value: Big| value / k.clone();
        let (cx, cy) = (over(d(0, 2)), over(d(1, 2)));
        let sxx = cx.clone() * cx.clone() - over(d(0, 0));
        let sxy = cx * cy.clone() - over(d(0, 1));
        let syy = cy.clone() * cy - over(d(1, 1));
        let value = |value: &Big| value.to_f64().value();
        let (trace, spread) = (value(&(sxx.clone() + syy.clone())), value(&(sxx.clone() - syy.clone())));
        let determinant = value(&(sxx * syy - sxy.clone() * sxy.clone()));
        let large = 0.5 * (trace + libm::hypot(spread, 2.0 * value(&sxy)));
        let small = if large > 0.0 { determinant / large } else { 0.0 };
        let allowed = number(&want["tol_blur_mm"]) + 4.0 * number(&want["tol_film_mm"]);
        for (key, square) in [("largest_mm", large), ("smallest_mm", small)] {
            let gap = (2.0 * square.max(0.0).sqrt() - number(&want["blur"][key])).abs();
            self.need(&format!("blur {key}, {label}"), gap, allowed);
        }
    }
}

#[test]
fn every_reference_camera_is_answered_within_its_tolerance() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/optics.json");
    let json: Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    let (mut wrong, mut count) = (Vec::new(), 0);
    for case in json["cases"].as_array().unwrap() {
        let name = case["name"].as_str().unwrap();
        let (_keep, folder) = program::folder(case["scene_toml"].as_str().unwrap());
        let mut points: Vec<String> = Vec::new();
        for want in case["projections"].as_array().into_iter().flatten() {
            let point = format!("{},{}", number(&want["u"]), number(&want["v"]));
            if !points.contains(&point) {
                points.push(point);
            }
        }
        let points = if points.is_empty() { "0,0".to_owned() } else { points.join(";") };
        let answer = program::run(&folder, &["optics", "scene.toml", "--json", "--samples-at", &points]);
        count += 1;
        if case["expect_error"].is_string() {
            answer.expect(2, &["scene.toml:10"]);
            assert!(answer.out.is_empty(), "{name}: {}", answer.out);
            continue;
        }
        answer.expect(0, &[]);
        let got = answer.json();
        let mut judge = Judge::default();
        judge.numbers(&got, &case["optics"], &case["tolerance"]);
        judge.planes_and_lines(&got, &case["optics"], &case["tolerance"]);
        judge.projections(&got, case);
        println!("{name}: largest error {:.2e} of what is allowed", judge.worst);
        wrong.extend(judge.wrong.into_iter().map(|text| format!("{name}: {text}")));
    }
    assert_eq!(count, 24);
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
