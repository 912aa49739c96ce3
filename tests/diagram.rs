//! Diagrams read back by their data attributes and held against the optics; labels by boxes; painters by pixels.

#[path = "common/drawing.rs"]
mod drawing;

use drawing::{Lcg, Panel, Point, camera, cameras, check_labels, check_rays, panels};
use glam::{DMat3, DVec3};
use groundglass::Camera;
use groundglass::diagram::{Figure, Inset, Item, Section, SideView, TextAs};
use groundglass::geometry::{Line, Plane};
use groundglass::optics::Optics;

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
            Item::Shape(_) | Item::Raster(_) => false,
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
fn the_ground_is_level_where_the_camera_looks_up_or_down() {
    let triangles = house();
    for pitch in [-40.0_f64, -6.0, 12.0, 40.0] {
        let mut camera = cameras()[1].1;
        camera.rail.axes = DMat3::from_rotation_y(0.3) * DMat3::from_rotation_x(pitch.to_radians());
        let optics = Optics::new(&camera).unwrap();
        let figure = SideView::new(&optics).section(Section::Side).subject(&triangles).figure().unwrap();
        let svg = figure.to_svg().unwrap();
        for panel in panels(&svg) {
            assert!((panel.up - DVec3::Y).length() < 1e-12 && panel.right.y.abs() < 1e-12, "{pitch}");
        }
        check_against_optics(&svg, &optics, &format!("pitch {pitch}"));
        check_labels(&figure, &format!("pitch {pitch}"));
    }
    // Looking down on a table, and without a subject, the rail lies along the page.
    let mut camera = cameras()[1].1;
    camera.rail.axes = DMat3::from_rotation_x(-1.2);
    let optics = Optics::new(&camera).unwrap();
    let figure = SideView::new(&optics).section(Section::Side).subject(&triangles).figure().unwrap();
    let forward = optics.camera().rail.axes * DVec3::NEG_Z;
    for panel in panels(&figure.to_svg().unwrap()) {
        assert!((panel.right - forward).length() < 1e-12);
    }
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

#[test]
fn a_side_view_of_nonsense_is_refused() {
    let camera = Camera::looking_at(DVec3::new(0.0, 1.6, 10.0), DVec3::ZERO).unwrap();
    let optics = Optics::new(&camera).unwrap();
    let view = || SideView::new(&optics);
    assert!(view().figure().is_ok());
    let hole = [[DVec3::ZERO, DVec3::X, DVec3::NAN]];
    let wrong = [
        (view().show(&["hinge-lin"]), "hinge-lin"),
        (view().hide(&["ray", "sky"]), "sky"),
        (view().up(DVec3::ZERO), "up"),
        (view().up(DVec3::NAN), "up"),
        (view().subject(&hole), "subject"),
    ];
    for (view, word) in wrong {
        let error = view.figure().unwrap_err().to_string();
        assert!(error.contains(word), "{error}");
    }
}
