//! Diagrams read back by their data attributes and held against the optics; labels by boxes; painters by pixels.

use glam::{DMat3, DVec3};
use groundglass::camera::{Aperture, Camera, FilmSize, Standard};
use groundglass::diagram::{Figure, Geometry, Inset, Item, Section, Segment, SideView, TextAs};
use groundglass::geometry::{Line, Plane, Pose};
use groundglass::optics::Optics;
use groundglass::quantity::{Angle, FNumber, Length};
use std::collections::BTreeMap;

fn camera(f: f64, number: f64, front: [f64; 2], rear: [f64; 2], extension: f64, film: &str) -> Camera {
    let standard = |[tilt, swing]: [f64; 2]| Standard {
        tilt: Angle::degrees(tilt),
        swing: Angle::degrees(swing),
        ..Standard::default()
    };
    Camera {
        rail: Pose { origin: DVec3::new(0.3, 1.6, -2.0), axes: DMat3::IDENTITY },
        front: standard(front),
        rear: standard(rear),
        extension: Length::millimetres(extension),
        focal_length: Length::millimetres(f),
        aperture: FNumber::new(number).map_or(Aperture::Pinhole, Aperture::FNumber),
        film: FilmSize::named(film).unwrap(),
        near: Length::millimetres(10.0),
    }
}

/// The cameras a textbook would show, and those at which a drawing might break.
fn cameras() -> Vec<(&'static str, Camera)> {
    let level = [0.0, 0.0];
    let tilted = camera(150.0, 16.0, [6.0, 0.0], level, 152.3, "4x5");
    let rail =
        Camera::rail_frame(DVec3::new(1e6, 2.0, -3.0), DVec3::new(1e6 + 1.0, 1.0, -9.0), DVec3::Y).unwrap();
    let mut shifted = camera(150.0, 22.0, [3.0, 0.0], [0.0, 2.0], 155.0, "4x5");
    shifted.front.rise = Length::millimetres(30.0);
    shifted.rear.shift = Length::millimetres(-20.0);
    vec![
        ("none tilted", camera(150.0, 16.0, level, level, 152.3, "4x5")),
        ("lens tilt 6", tilted),
        ("rear tilt 10", camera(150.0, 16.0, level, [10.0, 0.0], 156.0, "4x5")),
        ("both alike", camera(150.0, 16.0, [8.0, 0.0], [8.0, 0.0], 155.0, "4x5")),
        ("swing only", camera(210.0, 22.0, [0.0, 5.0], level, 220.0, "5x7")),
        ("tilt and swing", camera(150.0, 16.0, [4.0, 5.0], [0.0, -3.0], 154.0, "4x5")),
        ("macro 1:1", camera(100.0, 11.0, level, level, 200.0, "6x6")),
        ("8x10", camera(300.0, 32.0, [2.0, 0.0], level, 310.0, "8x10")),
        ("infinity", camera(150.0, 16.0, level, level, 150.0, "4x5")),
        ("pinhole", camera(150.0, -1.0, [2.0, 0.0], level, 150.0, "4x5")),
        ("film tilted 30", camera(150.0, 16.0, level, [30.0, 0.0], 160.0, "4x5")),
        ("eye at 1e6 m", Camera { rail, ..tilted }),
        ("rise and shift", shifted),
        ("tilt 1e-12", camera(150.0, 16.0, [1e-12, 0.0], level, 152.3, "4x5")),
    ]
}

/// Small and repeatable: a linear congruential generator (D. Knuth's MMIX constants).
struct Lcg(u64);

impl Lcg {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn camera(&mut self) -> Camera {
        let mut pick = |low: f64, high: f64| low + (high - low) * self.next();
        let f = pick(65.0, 360.0);
        let front = [pick(-12.0, 12.0), pick(-8.0, 8.0)];
        let rear = [pick(-12.0, 12.0), pick(-8.0, 8.0)];
        let flat = pick(0.0, 4.0) as usize;
        let keep = |v: [f64; 2]| match flat {
            0 => [0.0, 0.0],
            1 => [v[0], 0.0],
            2 => [0.0, v[1]],
            _ => v,
        };
        let films = ["35mm", "6x6", "6x9", "4x5", "5x7", "8x10", "4x5-portrait"];
        let film = films[(pick(0.0, 6.999)) as usize];
        let number = pick(2.8, 64.0);
        let stretch = if pick(0.0, 1.0) < 0.3 { pick(1.0, 2.2) } else { pick(0.99, 1.08) };
        let mut made = camera(f, number, keep(front), keep(rear), f * stretch, film);
        made.front.rise = Length::millimetres(pick(-20.0, 20.0));
        made
    }
}

type Point = [f64; 2];

/// One panel read back from the SVG.
struct Panel {
    name: String,
    origin: DVec3,
    right: DVec3,
    up: DVec3,
    page: [f64; 6],
    parts: BTreeMap<String, Vec<Part>>,
    frame: [f64; 4],
}

#[derive(Clone, Debug, Default)]
struct Part {
    off_page: Option<String>,
    segments: Vec<[Point; 2]>,
    circles: Vec<(Point, f64)>,
}

impl Panel {
    /// World to page.
    fn page_from_world(&self, world: DVec3) -> Point {
        let d = world - self.origin;
        let (x, y) = (self.right.dot(d), self.up.dot(d));
        let [a, b, c, d, e, f] = self.page;
        [a * x + c * y + e, b * x + d * y + f]
    }

    /// A page point in the world, relative to the section's origin.
    fn world_from_page(&self, p: Point) -> DVec3 {
        let [a, _, _, d, e, f] = self.page;
        self.right * ((p[0] - e) / a) + self.up * ((p[1] - f) / d)
    }

    fn scale(&self) -> f64 {
        self.page[0]
    }

    fn all(&self, part: &str) -> &[Part] {
        self.parts.get(part).map_or(&[], Vec::as_slice)
    }
}

fn numbers(text: &str) -> Vec<f64> {
    text.split_whitespace().map(|t| t.parse().unwrap()).collect()
}

fn panels(svg: &str) -> Vec<Panel> {
    let tree = roxmltree::Document::parse(svg).unwrap();
    let mut panels = Vec::new();
    for group in tree.descendants().filter(|n| n.has_attribute("data-panel")) {
        assert!(group.ancestors().skip(1).all(|n| !n.has_attribute("data-panel")), "panels do not nest");
        let section = numbers(group.attribute("data-section").unwrap());
        let page = numbers(group.attribute("data-page-from-section").unwrap());
        let vector = |i: usize| DVec3::new(section[i], section[i + 1], section[i + 2]);
        let mut parts: BTreeMap<String, Vec<Part>> = BTreeMap::new();
        for node in group.children().filter(|n| n.has_attribute("data-part")) {
            let part = Part {
                off_page: node.attribute("data-off-page").map(str::to_owned),
                segments: node.children().flat_map(segments).collect(),
                circles: node
                    .children()
                    .filter(|n| n.has_tag_name("circle"))
                    .map(|n| {
                        let get = |a: &str| n.attribute(a).unwrap().parse::<f64>().unwrap();
                        ([get("cx"), get("cy")], get("r"))
                    })
                    .collect(),
            };
            assert_eq!(part.off_page.is_some(), !node.children().any(|n| n.is_element()), "{node:?}");
            parts.entry(node.attribute("data-part").unwrap().to_owned()).or_default().push(part);
        }
        let corners: Vec<Point> = parts["frame"][0].segments.iter().map(|s| s[0]).collect();
        panels.push(Panel {
            name: group.attribute("data-panel").unwrap().to_owned(),
            origin: vector(0),
            right: vector(3),
            up: vector(6),
            page: page.try_into().unwrap(),
            parts,
            frame: [corners[0][0], corners[0][1], corners[2][0], corners[2][1]],
        });
    }
    panels
}

/// The straight pieces of a `<line>` or of a `<path>` of M, L and Z.
fn segments(node: roxmltree::Node) -> Vec<[Point; 2]> {
    let get = |a: &str| node.attribute(a).unwrap().parse::<f64>().unwrap();
    match node.tag_name().name() {
        "line" => vec![[[get("x1"), get("y1")], [get("x2"), get("y2")]]],
        "path" => {
            let d = node.attribute("d").unwrap();
            if d.contains(['Q', 'C']) {
                return Vec::new();
            }
            let spaced = d.replace('M', " M ").replace('L', " L ").replace('Z', " Z ");
            let (mut found, mut first, mut last) = (Vec::new(), [0.0; 2], None);
            let mut words = spaced.split_whitespace();
            while let Some(command) = words.next() {
                if command == "Z" {
                    found.push([last.unwrap(), first]);
                    continue;
                }
                let p = [words.next().unwrap().parse().unwrap(), words.next().unwrap().parse().unwrap()];
                match command {
                    "M" => first = p,
                    "L" => found.push([last.unwrap(), p]),
                    other => panic!("command {other}"),
                }
                last = Some(p);
            }
            found
        }
        _ => Vec::new(),
    }
}

fn figure(optics: &Optics, section: Section) -> Figure {
    SideView::new(optics).section(section).figure().unwrap()
}

/// Checks a plane's trace in a panel: what is drawn lies on it, and nothing is missing that is on the page.
fn check_trace(panel: &Panel, optics: &Optics, part: &str, plane: Plane, what: &str) {
    let drawn = panel.all(part);
    assert_eq!(drawn.len(), 1, "{what}: {part} in {}", panel.name);
    // Lens space relative to the world keeps digits at 1e6 m; the section's origin is the lens centre.
    let plane = optics.world_from_lens().vector(plane.m);
    let e = match part {
        "film-plane" => optics.film_plane().e,
        "front-focal-plane" => optics.front_focal_plane().e,
        "lens-plane" | "film-parallel" => 0.0,
        _ => f64::NAN,
    };
    let e = if e.is_nan() { pulled(optics, part).e } else { e };
    let (mu, mv) = (plane.dot(panel.right), plane.dot(panel.up));
    let length = libm::hypot(mu, mv);
    let off = |p: Point| {
        let x = panel.world_from_page(p);
        (plane.dot(x) + e) / length * panel.scale()
    };
    for [a, b] in &drawn[0].segments {
        for p in [a, b] {
            assert!(off(*p).abs() < 0.02, "{what}: {part} off by {} mm in {}", off(*p), panel.name);
        }
    }
    if let Some(why) = &drawn[0].off_page
        && length > 0.0
    {
        let [l, t, r, b] = panel.frame;
        let signs: Vec<bool> = [[l, t], [r, t], [r, b], [l, b]].iter().map(|&p| off(p) > 0.02).collect();
        assert!(signs.iter().all(|&s| s == signs[0]), "{what}: {part} is on the page, said {why}");
    }
}

fn pulled(optics: &Optics, part: &str) -> Plane {
    let depth = optics.depth_of_field(circle(optics));
    match part {
        "focus-plane" => optics.focus_plane(),
        "near-plane" => depth.unwrap().near,
        _ => depth.unwrap().far,
    }
}

fn circle(optics: &Optics) -> f64 {
    optics.camera().film.diagonal() / 1500.0
}

fn check_line(panel: &Panel, optics: &Optics, part: &str, line: Line, what: &str) {
    let drawn = panel.all(part);
    assert_eq!(drawn.len(), 1, "{what}: {part}");
    let pose = optics.world_from_lens();
    let (right, up) = (pose.vector_inverse(panel.right), pose.vector_inverse(panel.up));
    let point = line.normalized().meet_plane(Plane { m: right.cross(up), e: 0.0 });
    let expected = if line.is_at_infinity() || point.w.abs() < 1e-9 {
        None
    } else {
        let x = point.to_affine();
        Some([panel.page[4] + panel.scale() * right.dot(x), panel.page[5] - panel.scale() * up.dot(x)])
    };
    let [l, t, r, b] = panel.frame;
    match (&drawn[0].circles[..], expected) {
        ([(center, _)], Some(p)) => {
            let off = libm::hypot(center[0] - p[0], center[1] - p[1]);
            assert!(off < 0.02, "{what}: {part} off by {off} mm");
        }
        ([], Some(p)) => {
            assert!(drawn[0].off_page.is_some());
            let inside = p[0] > l + 0.01 && p[0] < r - 0.01 && p[1] > t + 0.01 && p[1] < b - 0.01;
            assert!(!inside, "{what}: {part} is on the page at {p:?}");
            assert!(!panel.all("arrow").is_empty(), "{what}: an arrow shows where the {part} is");
        }
        ([], None) => assert!(drawn[0].off_page.is_some()),
        other => panic!("{what}: {part} {other:?}"),
    }
}

fn check_against_optics(svg: &str, optics: &Optics, what: &str) {
    assert!(!svg.contains("transform"), "{what}");
    assert!(!svg.contains("\n\n") && !svg.contains("NaN") && !svg.contains("inf\""), "{what}");
    assert!(svg.len() < 60_000, "{what}: {} bytes", svg.len());
    let panels = panels(svg);
    assert!(!panels.is_empty());
    for panel in &panels {
        check_trace(panel, optics, "lens-plane", optics.lens_plane(), what);
        check_trace(panel, optics, "film-plane", optics.film_plane(), what);
        check_trace(panel, optics, "focus-plane", optics.focus_plane(), what);
        check_trace(panel, optics, "film-parallel", optics.film_parallel_plane(), what);
        check_trace(panel, optics, "front-focal-plane", optics.front_focal_plane(), what);
        if let Some(depth) = optics.depth_of_field(circle(optics)) {
            check_trace(panel, optics, "near-plane", depth.near, what);
            check_trace(panel, optics, "far-plane", depth.far, what);
        } else {
            assert!(panel.all("near-plane").is_empty() && panel.all("wedge").is_empty());
        }
        check_line(panel, optics, "scheimpflug-line", optics.scheimpflug_line(), what);
        check_line(panel, optics, "hinge-line", optics.hinge_line(), what);
        for part in ["lens-plane", "film-plane"] {
            assert!(panel.all(part)[0].off_page.is_none(), "{what}: {part} in {}", panel.name);
        }
        check_rays(panel, optics, what);
        check_film(panel, optics, what);
    }
}

/// A ray's piece before the lens points to the conjugate of its film point.
fn check_rays(panel: &Panel, optics: &Optics, what: &str) {
    let pose = optics.world_from_lens();
    for ray in panel.all("ray") {
        let [[film, lens], [again, end]] = ray.segments[..] else { panic!("{what}: a ray has two pieces") };
        assert_eq!(lens, again);
        let x = pose.vector_inverse(panel.world_from_page(film));
        let s = pose.vector_inverse(panel.world_from_page(lens));
        // Page coordinates are rounded to 0.0005 mm: as lengths of the section.
        let fuzz = 0.001 / panel.scale();
        assert!(
            (optics.film_normal().dot(x) + optics.film_plane().e).abs() < fuzz,
            "{what}: begins on the film"
        );
        assert!(optics.axis().dot(s).abs() < fuzz, "{what}: bends in the lens plane");
        let q = optics.object_of(groundglass::geometry::HomogeneousPoint::finite(x));
        let mut direction = pose.vector(s * q.w - q.xyz);
        if direction.dot(pose.vector(optics.axis())) < 0.0 {
            direction = -direction;
        }
        let to = [panel.right.dot(direction), -panel.up.dot(direction)];
        let length = libm::hypot(to[0], to[1]);
        let along = [end[0] - lens[0], end[1] - lens[1]];
        let reach = libm::hypot(along[0], along[1]);
        let off = (to[0] * along[1] - to[1] * along[0]) / length;
        // The film point's rounding is magnified as the picture is.
        let magnified = 0.02 + 0.002 * reach / libm::hypot(film[0] - lens[0], film[1] - lens[1]);
        assert!(off.abs() < magnified, "{what}: a ray misses its image point by {off} mm");
        assert!(to[0] * along[0] + to[1] * along[1] > 0.0);
    }
}

fn check_film(panel: &Panel, optics: &Optics, what: &str) {
    let film = &panel.all("film")[0];
    if film.off_page.is_some() {
        return;
    }
    let pose = optics.world_from_lens();
    let (fx, fy) = optics.film_axes();
    let size = optics.camera().film;
    let half = [0.5 * size.width.as_metres(), 0.5 * size.height.as_metres()];
    let mut ends = 0;
    for p in film.segments[0] {
        let beside = pose.vector_inverse(panel.world_from_page(p)) - optics.film_center();
        let (x, y) = (fx.dot(beside).abs(), fy.dot(beside).abs());
        let fuzz = 0.002 / panel.scale();
        assert!(x < half[0] + fuzz && y < half[1] + fuzz, "{what}: the film's end lies on the film");
        if (x - half[0]).abs() < fuzz || (y - half[1]).abs() < fuzz {
            ends += 1;
        }
    }
    assert_eq!(ends, 2, "{what}: both ends lie on the film's edge");
}

#[test]
fn every_plane_and_line_is_where_the_optics_say() {
    for (what, camera) in cameras() {
        let optics = Optics::new(&camera).unwrap();
        for section in [Section::Auto, Section::Side, Section::Top] {
            for inset in [Inset::Auto, Inset::Always, Inset::Never] {
                let figure = SideView::new(&optics).section(section).inset(inset).figure().unwrap();
                check_against_optics(
                    &figure.to_svg().unwrap(),
                    &optics,
                    &format!("{what}, {section:?}, {inset:?}"),
                );
            }
        }
    }
}

#[test]
fn section_of_tilt_is_the_side_and_of_swing_the_top() {
    for (what, camera) in cameras() {
        let optics = Optics::new(&camera).unwrap();
        let title = figure(&optics, Section::Auto).display_list().title.clone();
        let expected = match what {
            "swing only" => "top view",
            "tilt and swing" | "rise and shift" => "oblique section",
            _ => "side view",
        };
        assert!(title.ends_with(expected), "{what}: {title}");
    }
}

/// Boxes of labels, heavy strokes and frames, from the display list.
fn check_labels(figure: &Figure, what: &str) {
    for item in &figure.display_list().items {
        let Item::Group(panel) = item else { continue };
        if panel.panel.is_none() {
            continue;
        }
        let mut labels: Vec<(String, [f64; 4])> = Vec::new();
        let mut heavy: Vec<(Point, Point, f64)> = Vec::new();
        let mut frame = [0.0; 4];
        for part in &panel.items {
            let Item::Group(part) = part else { continue };
            let name = part.part.unwrap();
            let mut bounds: Option<[f64; 4]> = None;
            let mut said = String::new();
            for item in &part.items {
                match item {
                    Item::Text(text) => {
                        said += &text.plain();
                        let b = bounds.get_or_insert(text.bounds);
                        let t = text.bounds;
                        *b = [b[0].min(t[0]), b[1].min(t[1]), b[2].max(t[2]), b[3].max(t[3])];
                    }
                    Item::Shape(shape) => {
                        let width = shape.stroke.map_or(0.0, |s| s.width);
                        let ends = straight(&shape.geometry);
                        if name == "frame" {
                            let (p, q) = (ends[0].0, ends[1].1);
                            frame = [p[0], p[1], q[0], q[1]];
                        } else if width >= 0.5 {
                            heavy.extend(ends.iter().map(|&(a, b)| (a, b, 0.5 * width)));
                        }
                    }
                    Item::Group(_) => {}
                }
            }
            if name == "label" {
                labels.push((said, bounds.unwrap()));
            }
        }
        for (i, (said, b)) in labels.iter().enumerate() {
            let clear = b[0] > frame[0] + 0.3
                && b[1] > frame[1] + 0.3
                && b[2] < frame[2] - 0.3
                && b[3] < frame[3] - 0.3;
            assert!(clear, "{what}: `{said}` touches the frame");
            for (other, o) in &labels[..i] {
                let apart = b[2] < o[0] || o[2] < b[0] || b[3] < o[1] || o[3] < b[1];
                assert!(apart, "{what}: `{said}` touches `{other}`");
            }
            for &(p, q, half) in &heavy {
                assert!(!touches(p, q, *b, half), "{what}: `{said}` touches a heavy line");
            }
        }
    }
}

fn straight(geometry: &Geometry) -> Vec<(Point, Point)> {
    match geometry {
        Geometry::Line(a, b) => vec![(*a, *b)],
        Geometry::Circle { center, .. } => vec![(*center, *center)],
        Geometry::Path(path) => {
            let points: Vec<Point> = path
                .iter()
                .filter_map(|s| match s {
                    Segment::Move(p) | Segment::Line(p) | Segment::Quad(_, p) | Segment::Cubic(_, _, p) => {
                        Some(*p)
                    }
                    Segment::Close => None,
                })
                .collect();
            points.windows(2).map(|w| (w[0], w[1])).collect()
        }
    }
}

fn touches(a: Point, b: Point, bounds: [f64; 4], half: f64) -> bool {
    (0..=400).any(|i| {
        let t = f64::from(i) / 400.0;
        let p = [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])];
        p[0] > bounds[0] - half
            && p[0] < bounds[2] + half
            && p[1] > bounds[1] - half
            && p[1] < bounds[3] + half
    })
}

#[test]
fn no_label_touches_a_label_a_heavy_line_or_the_frame() {
    for (what, camera) in cameras() {
        let optics = Optics::new(&camera).unwrap();
        for section in [Section::Auto, Section::Side, Section::Top] {
            let figure = figure(&optics, section);
            check_labels(&figure, &format!("{what}, {section:?}"));
            if section == Section::Auto {
                for name in ["lens", "film", "focus plane"] {
                    let name = if what == "pinhole" && name == "lens" { "pinhole" } else { name };
                    assert!(says(&figure, name), "{what}: {name}");
                }
            }
        }
    }
}

/// Whether a label of the figure begins with these words.
fn says(figure: &Figure, words: &str) -> bool {
    fn any(items: &[Item], words: &str) -> bool {
        items.iter().any(|item| match item {
            Item::Group(g) => any(&g.items, words),
            Item::Text(t) => t.plain().starts_with(words),
            Item::Shape(_) => false,
        })
    }
    any(&figure.display_list().items, words)
}

#[test]
fn random_cameras_are_drawn_right_and_legible() {
    let mut random = Lcg(7);
    let mut drawn = 0;
    for i in 0..200 {
        let camera = random.camera();
        let Ok(optics) = Optics::new(&camera) else { continue };
        let figure = figure(&optics, Section::Auto);
        check_labels(&figure, &format!("random {i}"));
        check_against_optics(&figure.to_svg().unwrap(), &optics, &format!("random {i}"));
        drawn += 1;
    }
    assert_eq!(drawn, 200);
}

/// A gabled house and its ground.
fn house() -> Vec<[DVec3; 3]> {
    let profile = [[0.0, 0.0], [0.0, 3.0], [-2.5, 5.0], [-5.0, 3.0], [-5.0, 0.0], [-12.0, 0.0], [6.0, 0.0]];
    let mut triangles = Vec::new();
    for pair in profile.windows(2) {
        let at = |x: f64, [z, y]: [f64; 2]| DVec3::new(x, y, z - 11.0);
        triangles.push([at(-3.0, pair[0]), at(3.0, pair[0]), at(3.0, pair[1])]);
        triangles.push([at(-3.0, pair[0]), at(3.0, pair[1]), at(-3.0, pair[1])]);
    }
    triangles
}

#[test]
fn the_subject_is_drawn_where_the_section_cuts_it() {
    let optics = Optics::new(&cameras()[1].1).unwrap();
    let triangles = house();
    let figure = SideView::new(&optics).subject(&triangles).figure().unwrap();
    let panels = panels(&figure.to_svg().unwrap());
    let main = panels.iter().find(|p| p.name == "main").unwrap();
    let subject = main.all("subject").first().unwrap();
    let gable = main.page_from_world(DVec3::new(0.3, 5.0, -13.5));
    let nearest = subject
        .segments
        .iter()
        .flatten()
        .map(|p| libm::hypot(p[0] - gable[0], p[1] - gable[1]))
        .fold(f64::INFINITY, f64::min);
    // The grid of the outline is 0.02 mm.
    assert!(nearest < 0.02, "{nearest}");
    assert!(subject.segments.len() <= 8, "{}", subject.segments.len());
    check_labels(&figure, "house");
}

#[test]
fn both_painters_show_the_same() {
    let triangles = house();
    for (what, camera) in cameras().into_iter().take(6) {
        let optics = Optics::new(&camera).unwrap();
        let figure = SideView::new(&optics).subject(&triangles).title("Title, f′ ≥ 2").figure().unwrap();
        let (width, height, pixels) = figure.to_pixels(6.0).unwrap();
        let tree =
            resvg::usvg::Tree::from_str(&figure.to_svg().unwrap(), &resvg::usvg::Options::default()).unwrap();
        let mut pixmap = resvg::tiny_skia::Pixmap::new(width, height).unwrap();
        let scale = width as f32 / tree.size().width();
        resvg::render(&tree, resvg::tiny_skia::Transform::from_scale(scale, scale), &mut pixmap.as_mut());
        let other = pixmap.take_demultiplied();
        let (mut sum, mut many) = (0.0, 0);
        for (p, q) in pixels.chunks(4).zip(other.chunks(4)) {
            let most = p.iter().zip(q).map(|(&a, &b)| a.abs_diff(b)).max().unwrap();
            sum += f64::from(most);
            many += u32::from(most > 40);
        }
        let count = f64::from(width * height);
        println!("{what}: mean {:.4}, share over 40: {:.6}", sum / count, f64::from(many) / count);
        assert!(sum / count < 0.5, "{what}: mean difference {}", sum / count);
        assert!(f64::from(many) / count < 0.001, "{what}: {many} pixels differ");
    }
}

#[test]
fn the_same_figure_has_the_same_bytes_and_ids_of_its_own() {
    let all = cameras();
    let draw = |i: usize| {
        let optics = Optics::new(&all[i].1).unwrap();
        figure(&optics, Section::Auto).to_svg().unwrap()
    };
    assert_eq!(draw(1), draw(1));
    let id = |svg: &str| svg.split("id=\"").nth(1).unwrap().split('"').next().unwrap().to_owned();
    assert_ne!(id(&draw(1)), id(&draw(2)));
    let optics = Optics::new(&all[1].1).unwrap();
    let png = figure(&optics, Section::Auto).to_png(4.0).unwrap();
    assert_eq!(png, figure(&optics, Section::Auto).to_png(4.0).unwrap());
    assert!(png.starts_with(b"\x89PNG"));
}

#[test]
fn text_can_stay_text() {
    let optics = Optics::new(&cameras()[1].1).unwrap();
    let svg = figure(&optics, Section::Auto).to_svg_with(TextAs::Text).unwrap();
    assert!(
        svg.contains("focus plane") && svg.contains("<tspan font-style=\"italic\">") && !svg.contains("<use")
    );
    roxmltree::Document::parse(&svg).unwrap();
}

#[test]
fn what_cannot_be_drawn_is_an_error() {
    let optics = Optics::new(&cameras()[1].1).unwrap();
    let view = SideView::new(&optics);
    assert!(view.clone().title("\u{4e2d}").figure().is_err());
    assert!(view.clone().page(10.0, 10.0).figure().is_err());
    assert!(view.clone().circle_of_confusion(-1.0).figure().is_err());
    assert!(view.clone().figure().unwrap().to_png(1e6).is_err());
    assert!(view.figure().unwrap().to_png(f64::NAN).is_err());
}

#[test]
fn extreme_cameras_are_drawn_or_refused_without_panic() {
    let level = [0.0, 0.0];
    for f in [1e-6, 1.0, 1e5, 1e12] {
        for stretch in [1e-6, 1.0, 1.000_000_001, 1e9] {
            for (front, rear) in [(level, level), ([89.9, 0.0], level), ([0.0, -60.0], [45.0, 45.0])] {
                for number in [1e-3, 1e3] {
                    let Ok(optics) = Optics::new(&camera(f, number, front, rear, f * stretch, "4x5")) else {
                        continue;
                    };
                    for section in [Section::Auto, Section::Top] {
                        if let Ok(figure) = SideView::new(&optics).section(section).figure() {
                            figure.to_svg().unwrap();
                        }
                    }
                }
            }
        }
    }
}
