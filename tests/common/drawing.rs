//! Drawings read back: panels and their parts from the SVG, boxes of labels from the display list; and cameras to draw,
//! those of a textbook and random ones.

#![allow(dead_code, reason = "each test binary uses its part")]

use glam::{DMat3, DVec3};
use groundglass::camera::{Aperture, Camera, FilmSize, Standard};
use groundglass::diagram::{Figure, Geometry, Item, Segment};
use groundglass::geometry::{HomogeneousPoint, Pose};
use groundglass::optics::Optics;
use groundglass::quantity::{Angle, FNumber, Length};
use std::collections::BTreeMap;

pub fn camera(f: f64, number: f64, front: [f64; 2], rear: [f64; 2], extension: f64, film: &str) -> Camera {
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
pub fn cameras() -> Vec<(&'static str, Camera)> {
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
pub struct Lcg(pub u64);

impl Lcg {
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn camera(&mut self) -> Camera {
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

pub type Point = [f64; 2];

/// One panel read back from the SVG.
pub struct Panel {
    pub name: String,
    pub origin: DVec3,
    pub right: DVec3,
    pub up: DVec3,
    pub page: [f64; 6],
    pub parts: BTreeMap<String, Vec<Part>>,
    pub frame: [f64; 4],
}

#[derive(Clone, Debug, Default)]
pub struct Part {
    pub off_page: Option<String>,
    pub segments: Vec<[Point; 2]>,
    pub circles: Vec<(Point, f64)>,
    /// Its other attributes.
    pub data: BTreeMap<String, String>,
}

impl Panel {
    /// World to page.
    pub fn page_from_world(&self, world: DVec3) -> Point {
        let d = world - self.origin;
        let (x, y) = (self.right.dot(d), self.up.dot(d));
        let [a, b, c, d, e, f] = self.page;
        [a * x + c * y + e, b * x + d * y + f]
    }

    /// A page point in the world, relative to the section's origin.
    pub fn world_from_page(&self, p: Point) -> DVec3 {
        let [a, _, _, d, e, f] = self.page;
        self.right * ((p[0] - e) / a) + self.up * ((p[1] - f) / d)
    }

    pub fn scale(&self) -> f64 {
        self.page[0]
    }

    pub fn all(&self, part: &str) -> &[Part] {
        self.parts.get(part).map_or(&[], Vec::as_slice)
    }
}

pub fn numbers(text: &str) -> Vec<f64> {
    text.split_whitespace().map(|t| t.parse().unwrap()).collect()
}

pub fn panels(svg: &str) -> Vec<Panel> {
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
                data: node.attributes().map(|a| (a.name().to_owned(), a.value().to_owned())).collect(),
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
pub fn segments(node: roxmltree::Node) -> Vec<[Point; 2]> {
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

/// A ray's piece before the lens points to the conjugate of its film point.
pub fn check_rays(panel: &Panel, optics: &Optics, what: &str) {
    for ray in panel.all("ray") {
        check_ray(panel, optics, ray, what);
    }
}

/// As [`check_rays`], one ray.
pub fn check_ray(panel: &Panel, optics: &Optics, ray: &Part, what: &str) {
    let pose = optics.world_from_lens();
    let [[film, lens], [again, end]] = ray.segments[..] else { panic!("{what}: a ray has two pieces") };
    assert_eq!(lens, again);
    let x = pose.vector_inverse(panel.world_from_page(film));
    let s = pose.vector_inverse(panel.world_from_page(lens));
    // Page coordinates are rounded to 0.0005 mm: as lengths of the section.
    let fuzz = 0.001 / panel.scale();
    assert!((optics.film_normal().dot(x) + optics.film_plane().e).abs() < fuzz, "{what}: begins on the film");
    assert!(optics.axis().dot(s).abs() < fuzz, "{what}: bends in the lens plane");
    let q = optics.object_of(HomogeneousPoint::finite(x));
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

/// Where the words of a figure stand: corners of their boxes, turned with them.
pub type Corners = [Point; 4];

/// Whether a side of one of two rectangles parts them; touching within `least` millimetres is no touching.
pub fn apart(a: &Corners, b: &Corners, least: f64) -> bool {
    [a, b].iter().any(|corners| {
        [[0, 1], [1, 2]].iter().any(|&[i, j]| {
            let (p, q) = (corners[i], corners[j]);
            let length = libm::hypot(q[0] - p[0], q[1] - p[1]);
            let along = [(q[0] - p[0]) / length, (q[1] - p[1]) / length];
            let range = |c: &Corners| {
                let at = c.map(|p| p[0] * along[0] + p[1] * along[1]);
                at.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], x| [l.min(*x), h.max(*x)])
            };
            let (a, b) = (range(a), range(b));
            a[1] <= b[0] + least || b[1] <= a[0] + least
        })
    })
}

/// Boxes of labels, heavy strokes and frames, from the display list.
pub fn check_labels(figure: &Figure, what: &str) {
    for item in &figure.display_list().items {
        let Item::Group(panel) = item else { continue };
        if panel.panel.is_none() {
            continue;
        }
        let mut labels: Vec<(String, Vec<Corners>)> = Vec::new();
        let mut heavy: Vec<(Point, Point, f64)> = Vec::new();
        let mut frame = [0.0; 4];
        for part in &panel.items {
            let Item::Group(part) = part else { continue };
            let name = part.part.unwrap();
            let (mut boxes, mut said) = (Vec::new(), String::new());
            for item in &part.items {
                match item {
                    Item::Text(text) => {
                        said += &text.plain();
                        boxes.push(text.corners());
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
                    Item::Group(_) | Item::Raster(_) => {}
                }
            }
            if name == "label" && part.off_page.is_none() {
                labels.push((said, boxes));
            }
        }
        for (i, (said, boxes)) in labels.iter().enumerate() {
            for [x, y] in boxes.iter().flatten() {
                let clear =
                    *x > frame[0] + 0.3 && *y > frame[1] + 0.3 && *x < frame[2] - 0.3 && *y < frame[3] - 0.3;
                assert!(clear, "{what}: `{said}` touches the frame");
            }
            for (other, others) in &labels[..i] {
                let apart = boxes.iter().all(|a| others.iter().all(|b| apart(a, b, 0.0)));
                assert!(apart, "{what}: `{said}` touches `{other}`");
            }
            for &(p, q, half) in &heavy {
                assert!(
                    !boxes.iter().any(|b| touches(p, q, b, half)),
                    "{what}: `{said}` touches a heavy line"
                );
            }
        }
    }
}

pub fn straight(geometry: &Geometry) -> Vec<(Point, Point)> {
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

/// Whether a line of some width comes into a rectangle.
pub fn touches(a: Point, b: Point, corners: &Corners, half: f64) -> bool {
    let [o, x, _, y] = *corners;
    let side = |p: Point| {
        let length = libm::hypot(p[0] - o[0], p[1] - o[1]);
        ([(p[0] - o[0]) / length, (p[1] - o[1]) / length], length)
    };
    let ((u, wide), (v, high)) = (side(x), side(y));
    (0..=400).any(|i| {
        let t = f64::from(i) / 400.0;
        let p = [a[0] + t * (b[0] - a[0]) - o[0], a[1] + t * (b[1] - a[1]) - o[1]];
        let (along, down) = (p[0] * u[0] + p[1] * u[1], p[0] * v[0] + p[1] * v[1]);
        along > -half && along < wide + half && down > -half && down < high + half
    })
}
