//! The laws hold in the drawings: every kind that shows a camera is drawn for the cameras of a textbook and for random ones,
//! and its planes, lines, rays and circles are where the optics say, to 0.02 mm; no word touches another.

#[path = "common/book.rs"]
mod book;
#[path = "common/drawing.rs"]
mod drawing;

use book::book;
use drawing::{Corners, Lcg, Panel, Part, Point, apart, camera, cameras, check_labels, check_ray, panels};
use glam::DVec3;
use groundglass::camera::{Aperture, Camera, Standard};
use groundglass::diagram::{Changes, Figure, FigureFile, Item};
use groundglass::geometry::{HomogeneousPoint, Line, Plane, Pose};
use groundglass::optics::{Adjust, FocusTarget, Optics, solve};
use groundglass::quantity::{Angle, FNumber, Length};
use groundglass::sampling::{ApertureShape, PointSet, sample_of};
use groundglass::scene::{Document, Files};
use std::fs;

const KINDS: [&str; 11] = [
    "scheimpflug",
    "hinge",
    "both-rules",
    "focus-sweep",
    "tilt-sweep",
    "film-tilt-vs-lens-tilt",
    "wedge",
    "exact-blur",
    "limits-compared",
    "accumulation",
    "solve",
];

/// A figure file of a kind for a camera.
fn file(kind: &str, camera: &Camera) -> String {
    let eye = camera.rail.origin;
    let at = camera.rail.point(DVec3::NEG_Z);
    let aperture = match camera.aperture {
        Aperture::Pinhole => "pinhole = true".to_owned(),
        Aperture::FNumber(n) => format!("f_number = {:?}", n.get()),
    };
    let standard = |name: &str, s: &Standard| {
        format!(
            "[camera.{name}]\ntilt_deg = {:?}\nswing_deg = {:?}\nrise_mm = {:?}\nshift_mm = {:?}\n",
            s.tilt.as_degrees(),
            s.swing.as_degrees(),
            s.rise.as_millimetres(),
            s.shift.as_millimetres()
        )
    };
    format!(
        "kind = \"{kind}\"\ntitle = \"A title\"\n[camera]\neye_m = [{:?}, {:?}, {:?}]\nlook_at_m = [{:?}, {:?}, {:?}]\n\
         focal_length_mm = {:?}\n{aperture}\nfilm_mm = [{:?}, {:?}]\nextension_mm = {:?}\n{}{}",
        eye.x,
        eye.y,
        eye.z,
        at.x,
        at.y,
        at.z,
        camera.focal_length.as_millimetres(),
        camera.film.width.as_millimetres(),
        camera.film.height.as_millimetres(),
        camera.extension.as_millimetres(),
        standard("front", &camera.front),
        standard("rear", &camera.rear)
    )
}

fn draw(text: &str, changes: Changes) -> groundglass::Result<Figure> {
    let document = Document::from_bytes(text.as_bytes(), "figure.toml")?;
    FigureFile::from_document(document)?.draw(&Files::new(), "".as_ref(), changes)
}

/// The camera that a drawn part belongs to.
fn belongs(camera: &Camera, part: &Part) -> Optics {
    let number = |name: &str| part.data.get(name).map(|text| text.parse::<f64>().unwrap());
    let mut camera = *camera;
    if let Some(extension) = number("data-extension-mm") {
        camera.extension = Length::millimetres(extension);
    }
    if let Some(tilt) = number("data-tilt-deg") {
        camera.front.tilt = Angle::degrees(tilt);
    }
    if let Some(f_number) = number("data-f-number") {
        camera.aperture = Aperture::FNumber(FNumber::new(f_number).unwrap());
    }
    Optics::new(&camera).unwrap()
}

/// How far a page point lies from the trace of a plane (lens space), millimetres.
fn off(panel: &Panel, optics: &Optics, plane: Plane, p: Point) -> f64 {
    let m = optics.world_from_lens().vector(plane.m);
    let length = libm::hypot(m.dot(panel.right), m.dot(panel.up));
    (m.dot(panel.world_from_page(p)) + plane.e) / length * panel.scale()
}

fn check_line(panel: &Panel, optics: &Optics, part: &Part, line: Line, what: &str) {
    let pose = optics.world_from_lens();
    let (right, up) = (pose.vector_inverse(panel.right), pose.vector_inverse(panel.up));
    for (center, _) in &part.circles {
        let x = line.normalized().meet_plane(Plane { m: right.cross(up), e: 0.0 }).to_affine();
        let p = [panel.page[4] + panel.scale() * right.dot(x), panel.page[5] - panel.scale() * up.dot(x)];
        let apart = libm::hypot(center[0] - p[0], center[1] - p[1]);
        assert!(apart < 0.02, "{what}: a line is {apart} mm off");
    }
}

/// On a contour the exact blur has its size: a hair beside it on one side more, on the other less.
fn check_contour(panel: &Panel, optics: &Optics, part: &Part, what: &str) {
    let wanted: f64 = part.data["data-blur"].parse().unwrap();
    let pose = optics.world_from_lens();
    let larger = |p: Point| {
        let x = pose.vector_inverse(panel.world_from_page(p));
        optics.blur_of(x).map(|blur| blur.largest > wanted)
    };
    for [p, _] in &part.segments {
        let beside = [[0.02, 0.0], [-0.02, 0.0], [0.0, 0.02], [0.0, -0.02]];
        let sides: Vec<_> = beside.iter().map(|d| larger([p[0] + d[0], p[1] + d[1]])).collect();
        assert!(sides.iter().any(|side| *side != sides[0]), "{what}: no blur of {wanted} at {p:?}");
    }
}

/// Checks every part of a panel that the optics know.
fn check_panel(panel: &Panel, camera: &Camera, circle: f64, what: &str) {
    for (name, parts) in &panel.parts {
        for part in parts {
            let optics = belongs(camera, part);
            let what = format!("{what}, {}, {name}", panel.name);
            let depth = optics.depth_of_field(circle);
            let plane = match name.as_str() {
                "lens-plane" => Some(optics.lens_plane()),
                "film-plane" | "film" => Some(optics.film_plane()),
                "focus-plane" => Some(optics.focus_plane()),
                "film-parallel" => Some(optics.film_parallel_plane()),
                "front-focal-plane" => Some(optics.front_focal_plane()),
                "near-plane" => depth.map(|d| d.near),
                "far-plane" => depth.map(|d| d.far),
                "merklinger-near" => optics.merklinger_limits(circle).map(|d| d.near),
                "merklinger-far" => optics.merklinger_limits(circle).map(|d| d.far),
                "untilted-near" => optics.untilted_limits(circle).map(|d| d.near),
                "untilted-far" => optics.untilted_limits(circle).map(|d| d.far),
                _ => None,
            };
            if let Some(plane) = plane {
                for p in part.segments.iter().flatten() {
                    let off = off(panel, &optics, plane, *p);
                    assert!(off.abs() < 0.02, "{what}: {off} mm off");
                }
            }
            match name.as_str() {
                "ray" => check_ray(panel, &optics, part, &what),
                "hinge-line" => check_line(panel, &optics, part, optics.hinge_line(), &what),
                "blur-contour" => check_contour(panel, &optics, part, &what),
                "scheimpflug-line" => check_line(panel, &optics, part, optics.scheimpflug_line(), &what),
                _ => {}
            }
        }
    }
}

/// The camera whose film, or lens (`Adjust::Front`), alone is turned until the plane is sharp that this camera has sharp.
fn turned(camera: &Camera, adjust: Adjust) -> Camera {
    let own = Optics::new(camera).unwrap();
    let plane = own.world_from_lens().plane(own.focus_plane()).normalized();
    let level = |s: Standard| Standard { tilt: Angle::ZERO, swing: Angle::ZERO, ..s };
    let start = Camera { front: level(camera.front), rear: level(camera.rear), ..*camera };
    let target = FocusTarget::Plane { point: plane.m * -plane.e, normal: plane.m };
    solve(&start, &target, adjust).unwrap()
}

/// Whether the line through two page points passes a third, to 0.02 mm, and the rounding of the two carried on.
fn passes([a, b]: [Point; 2], p: Point) -> bool {
    let long = libm::hypot(b[0] - a[0], b[1] - a[1]);
    let off = ((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])) / long;
    off.abs() < 0.02 + 0.001 * libm::hypot(p[0] - a[0], p[1] - a[1]) / long
}

/// Rays that show how pictures add up: from the middle of the film, through the lens plane and the film point's one image.
fn check_seen_rays(panel: &Panel, optics: &Optics, what: &str) {
    let pose = optics.world_from_lens();
    let film = optics.film_center();
    let [film, sharp] = [film, optics.object_of(HomogeneousPoint::finite(film)).to_affine()]
        .map(|p| panel.page_from_world(pose.point(p)));
    for ray in panel.all("seen-ray") {
        let [[a, b], [c, d]] = ray.segments[..] else { panic!("{what}: a ray has two pieces") };
        assert!(b == c && libm::hypot(a[0] - film[0], a[1] - film[1]) < 0.02, "{what}");
        assert!(off(panel, optics, optics.lens_plane(), b).abs() < 0.02, "{what}: bends in the lens plane");
        assert!(passes([c, d], sharp), "{what}: a ray misses the sharp point");
    }
}

/// The cones at the film: their tips are the images of the middle ray's points on the limits, and their rays run to them.
fn check_limit_rays(panel: &Panel, optics: &Optics, circle: f64, what: &str) {
    let depth = optics.depth_of_field(circle).unwrap();
    let tips: Vec<Point> = [depth.near, depth.far]
        .map(|plane| optics.image_of(plane.meet_ray(DVec3::ZERO, -optics.film_center())))
        .into_iter()
        .filter(|image| image.w != 0.0)
        .map(|image| panel.page_from_world(optics.world_from_lens().point(image.to_affine())))
        .collect();
    for (center, _) in panel.all("limit-image").iter().flat_map(|part| &part.circles) {
        let near = |tip: &Point| libm::hypot(center[0] - tip[0], center[1] - tip[1]) < 0.02;
        assert!(tips.iter().any(near), "{what}: {center:?} is no image of a limit");
    }
    for piece in panel.all("limit-ray").iter().flat_map(|part| &part.segments) {
        assert!(tips.iter().any(|tip| passes(*piece, *tip)), "{what}: a ray misses its image point");
    }
}

/// The boxes of all words: within the page, and apart.
fn check_words(figure: &Figure, what: &str) {
    fn words(items: &[Item], found: &mut Vec<(String, Corners)>) {
        for item in items {
            match item {
                Item::Group(group) => words(&group.items, found),
                Item::Text(text) => found.push((text.plain(), text.corners())),
                Item::Shape(_) | Item::Raster(_) => {}
            }
        }
    }
    let (list, mut found) = (figure.display_list(), Vec::new());
    words(&list.items, &mut found);
    for (i, (said, b)) in found.iter().enumerate() {
        let on_page =
            |p: &Point| p[0] >= 0.0 && p[1] >= 0.0 && p[0] <= list.page[0] && p[1] <= list.page[1] + 0.3;
        let inside = b.iter().all(on_page);
        assert!(inside, "{what}: `{said}` leaves the page at {b:?}");
        for (other, o) in &found[..i] {
            // Lines of one block stand as close as type is set.
            assert!(apart(b, o, 0.02), "{what}: `{said}` touches `{other}`");
        }
    }
}

/// Whether there is a figure; its laws hold.
fn check(kind: &str, camera: &Camera, what: &str) -> bool {
    let figure = match draw(&file(kind, camera), Changes::default()) {
        Ok(figure) => figure,
        // What cannot be had is told in the solver's words.
        Err(error) => {
            let told = error.to_string();
            let is_answer = [
                "pinhole",
                "no sharp point",
                "infinity",
                "face backwards",
                "no real image",
                "passes through",
                "stand behind",
                "hinge",
            ];
            assert!(is_answer.iter().any(|word| told.contains(word)), "{what}: {told}");
            return false;
        }
    };
    check_labels(&figure, what);
    check_words(&figure, what);
    let svg = figure.to_svg().unwrap();
    assert!(svg.len() < 90_000 && !svg.contains("NaN") && !svg.contains("\n\n"), "{what}: {}", svg.len());
    let circle = camera.film.diagonal() / 1500.0;
    let panels = panels(&svg);
    let own = Optics::new(camera).unwrap();
    for panel in &panels {
        match panel.name.as_str() {
            // The same plane of the world, made sharp by another camera that stands in the same place.
            "film-tilt" | "lens-tilt" => {
                let is_straight = |s: Standard| s.tilt == Angle::ZERO && s.swing == Angle::ZERO;
                let drawn = match panel.name.as_str() {
                    "film-tilt" => turned(camera, Adjust::Rear),
                    // A camera whose film is turned has its lens turned instead.
                    _ if is_straight(camera.front) && !is_straight(camera.rear) => {
                        turned(camera, Adjust::Front)
                    }
                    _ => *camera,
                };
                check_panel(panel, &drawn, circle, what);
                for p in panel.all("focus-plane").iter().flat_map(|part| part.segments.iter().flatten()) {
                    let off = off(panel, &own, own.focus_plane(), *p);
                    assert!(off.abs() < 0.02, "{what}, {}: the focus plane is {off} mm off", panel.name);
                }
            }
            "film" => {
                for part in panel.all("circle-of-confusion") {
                    for [p, q] in &part.segments {
                        let long = libm::hypot(p[0] - q[0], p[1] - q[1]);
                        let wanted = circle * libm::hypot(panel.page[0], panel.page[1]);
                        assert!((long - wanted).abs() < 0.02, "{what}: c is {long} and not {wanted} mm long");
                    }
                }
                check_limit_rays(panel, &own, circle, what);
                for p in panel.all("film").iter().flat_map(|part| part.segments.iter().flatten()) {
                    let off = off(panel, &own, own.film_plane(), *p);
                    assert!(off.abs() < 0.02, "{what}: the film is drawn {off} mm off");
                }
            }
            _ => {
                check_panel(panel, camera, circle, what);
                check_seen_rays(panel, &own, what);
            }
        }
    }
    true
}

#[test]
fn laws_hold_for_the_cameras_of_a_textbook() {
    let mut refused = Vec::new();
    for (name, camera) in cameras() {
        for kind in KINDS {
            let what = format!("{kind}, {name}");
            if !check(kind, &camera, &what) {
                refused.push(what);
            }
        }
    }
    // Nothing unsharp, or no point within reach, has no such figures; all others have.
    let none = [
        "film-tilt-vs-lens-tilt, infinity",
        "accumulation, infinity",
        "wedge, pinhole",
        "exact-blur, pinhole",
        "limits-compared, pinhole",
        "accumulation, pinhole",
    ];
    assert_eq!(refused, none);
}

#[test]
fn laws_hold_for_random_cameras() {
    let mut random = Lcg(11);
    let mut drawn = 0;
    for i in 0..200 {
        let camera = random.camera();
        let kind = KINDS[i % KINDS.len()];
        drawn += usize::from(check(kind, &camera, &format!("{kind}, random {i}")));
    }
    assert!(drawn >= 199, "{drawn} of 200 have a figure");
}

#[test]
fn the_book_is_legible_at_every_width() {
    for path in book() {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let document = Document::from_bytes(&fs::read(&path).unwrap(), &name).unwrap();
        let file = FigureFile::from_document(document).unwrap();
        let folder = fs::canonicalize(path.parent().unwrap()).unwrap();
        for width_mm in [None, Some(84.0), Some(122.0), Some(183.0)] {
            let changes = Changes { width_mm, ..Changes::default() };
            let what = format!("{name} at {width_mm:?}");
            let figure =
                file.draw(&Files::new(), &folder, changes).unwrap_or_else(|error| panic!("{what}: {error}"));
            check_labels(&figure, &what);
            check_words(&figure, &what);
            let svg = figure.to_svg().unwrap();
            assert!(!svg.contains("data-off-page=\"no-room\""), "{what}: {:?}", figure.not_shown());
        }
    }
}

#[test]
fn movements_move_as_their_signs_say() {
    let camera = cameras()[0].1;
    let figure = draw(&file("movements", &camera), Changes::default()).unwrap();
    check_words(&figure, "movements");
    let panels = panels(&figure.to_svg().unwrap());
    assert_eq!(panels.len(), 8);
    let slide = Length::millimetres(camera.focal_length.as_millimetres() / 5.0);
    for panel in &panels {
        let (standard, name) = panel.name.split_once('-').unwrap();
        let mut moved = Standard::default();
        match name {
            "rise" => moved.rise = slide,
            "shift" => moved.shift = slide,
            "tilt" => moved.tilt = Angle::degrees(15.0),
            _ => moved.swing = Angle::degrees(15.0),
        }
        let level = Camera { front: Standard::default(), rear: Standard::default(), ..camera };
        let camera = if standard == "front" {
            Camera { front: moved, ..level }
        } else {
            Camera { rear: moved, ..level }
        };
        check_panel(panel, &camera, 1e-4, &panel.name);
    }
}

/// A level camera of 150 mm at the world's origin, before a plane that cannot be had.
fn impossible(point: [f64; 3], normal: [f64; 3], rear: &str) -> String {
    format!(
        "kind = \"solve\"\nimpossible = {{ point_m = {point:?}, normal = {normal:?} }}\n[camera]\neye_m = [0, 0, 0]\n\
         look_at_m = [0, 0, -1]\nfocal_length_mm = 150\nf_number = 8\nfilm = \"4x5\"\nextension_mm = 160\n{rear}"
    )
}

#[test]
fn what_stops_a_solver_is_drawn() {
    let camera = camera(150.0, 8.0, [0.0, 0.0], [0.0, 0.0], 160.0, "4x5");
    let camera = Camera { rail: Pose { origin: DVec3::ZERO, ..camera.rail }, ..camera };
    let before = Optics::new(&camera).unwrap();
    // The hinge line nearer than f; oblique; the plane nearer than f; through the lens; the lens backwards; no film behind.
    /// A name, the plane's point and normal, more of the camera, and the parts that show what stops the solver.
    type Case<'a> = (&'a str, [f64; 3], [f64; 3], &'a str, &'a [&'a str]);
    let cases: [Case<'_>; 6] = [
        ("hinge", [0.0, -0.1, 0.0], [0.0, 1.0, 0.1], "", &["limit-circle", "impossible-hinge"]),
        ("oblique", [0.0, -0.1, 0.0], [0.4, 1.0, 0.1], "", &["limit-circle", "impossible-hinge"]),
        ("near", [0.0, 0.0, -0.12], [0.0, 0.2, 1.0], "", &["limit-circle", "plane-distance"]),
        ("through", [0.0, 0.0, 0.0], [0.0, 1.0, 0.3], "", &["impossible-point"]),
        (
            "backwards",
            [0.0, -0.1501, 0.0],
            [0.0, 1.0, -0.01],
            "[camera.rear]\ntilt_deg = 12",
            &["limit-plane"],
        ),
        (
            "film",
            [0.0, 0.0, -3.0],
            [0.0, 0.0, 1.0],
            "[camera.rear]\ntilt_deg = 80\nrise_mm = 4000",
            &["limit-plane"],
        ),
    ];
    for (what, point, normal, rear, parts) in cases {
        let text = impossible(point, normal, rear);
        let figure = draw(&text, Changes::default()).unwrap_or_else(|error| panic!("{what}: {error}"));
        check_labels(&figure, what);
        check_words(&figure, what);
        let panels = panels(&figure.to_svg().unwrap());
        let panel = panels.iter().find(|panel| panel.name == "stopped").unwrap();
        for part in parts {
            assert!(panel.parts.contains_key(*part), "{what}: no {part}, only {:?}", panel.parts.keys());
        }
        let unit = DVec3::from_array(normal) / DVec3::from_array(normal).length();
        let plane = Plane { m: unit, e: -unit.dot(DVec3::from_array(point)) };
        for p in panel.all("wanted-plane").iter().flat_map(|part| part.segments.iter().flatten()) {
            let off = off(panel, &before, plane, *p);
            assert!(off.abs() < 0.02, "{what}: the wanted plane is {off} mm off");
        }
        for (_, radius) in panel.all("limit-circle").iter().flat_map(|part| &part.circles) {
            assert!((radius - 0.15 * panel.scale()).abs() < 0.002, "{what}");
        }
        for [p, q] in panel.all("plane-distance").iter().flat_map(|part| &part.segments) {
            let long = libm::hypot(p[0] - q[0], p[1] - q[1]);
            assert!((long - plane.e.abs() * panel.scale()).abs() < 0.02, "{what}: {long}");
        }
    }
    let none = draw(&impossible([0.0; 3], [0.0; 3], ""), Changes::default()).unwrap_err().to_string();
    assert!(none.contains("figure.toml:2:") && none.contains("normal is zero"), "{none}");
}

#[test]
fn lens_points_fill_the_aperture_that_the_camera_has() {
    let camera = cameras()[1].1;
    let plain = file("aperture-samples", &camera);
    let table = "[camera.aperture]\nblades = 5\nrotation_deg = 20.0\n";
    let polygon = ApertureShape::Polygon { blades: 5, rotation: 20.0_f64.to_radians() };
    for (shape, set, extra) in [
        (ApertureShape::Disk, PointSet::Sobol, ""),
        (polygon, PointSet::Sobol, table),
        (polygon, PointSet::Halton, table),
    ] {
        let keys = format!("samples = 100\nseed = 3\npoints = \"{set}\"\n[camera]\n");
        let text = format!("{}{extra}", plain.replace("[camera]\n", &keys));
        let figure = draw(&text, Changes::default()).unwrap();
        check_labels(&figure, "aperture");
        check_words(&figure, "aperture");
        let panels = panels(&figure.to_svg().unwrap());
        let [panel] = &panels[..] else { panic!("one panel") };
        let radius = panel.scale() * Optics::new(&camera).unwrap().aperture_radius();
        let page = |p: [f64; 2]| [panel.page[4] + radius * p[0], panel.page[5] - radius * p[1]];
        let near = |p: Point, q: Point| libm::hypot(p[0] - q[0], p[1] - q[1]) < 0.002;
        let drawn = &panel.all("lens")[0];
        for (segment, corner) in drawn.segments.iter().zip(shape.corners()) {
            assert!(near(segment[0], page(corner)), "{shape:?}");
        }
        assert_eq!(drawn.segments.len(), shape.corners().len());
        assert_eq!(drawn.circles.len(), usize::from(shape == ApertureShape::Disk));
        let points = &panel.all("lens-sample")[0].circles;
        assert_eq!(points.len(), 100);
        for (i, (center, _)) in (0..).zip(points) {
            let sample = sample_of(set, &shape, 3, 0, i);
            assert!(near(*center, page(sample.lens.map(f64::from))), "{shape:?}, {set}, point {i}");
        }
    }
}
