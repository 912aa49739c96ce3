//! The parts of a camera's section and their order. In: the optics in section metres. Out: groups on a [`Canvas`], each
//! with its obstacles and labels.

use super::bodies::{bellows, camera, draw_subject};
use super::canvas::{Canvas, Label};
use super::display_list::{Geometry, Group, PanelFrame, Point, Shape};
use super::lines::{dimension_f, distance_j, focus_arrow, line_point};
use super::panel::Panel;
use super::place::Weight;
use super::planes::{Style, along, axis, camera_span, long_enough, stub, trace, wedge};
use super::rays::{pencil, rays};
use super::section::{Pierce, Section, SectionPlane};
use super::theme::{self, Hue, Theme, broken, solid};
use super::{extent, subject};
use crate::error::Result;
use crate::optics::{DepthOfField, Optics};
use glam::DVec3;
use std::collections::BTreeSet;

/// What all panels of a figure draw from.
pub(crate) struct Scene<'a> {
    pub(crate) optics: &'a Optics,
    pub(crate) section: SectionPlane,
    pub(crate) theme: &'a Theme,
    pub(crate) depth: Option<DepthOfField>,
    /// The ends of the film in the section (lens space), when the section cuts the film.
    pub(crate) film: Option<[DVec3; 2]>,
    /// Along the lens in the section, unit.
    pub(crate) lens: DVec3,
    /// Where the section cuts the subject, section metres.
    pub(crate) subject: Vec<[[f64; 2]; 2]>,
    /// Film points (lens space) that bundles of rays come to.
    pub(crate) bundles: Vec<DVec3>,
    /// Names of parts that are left out.
    pub(crate) hidden: &'a BTreeSet<String>,
}

impl<'a> Scene<'a> {
    /// The scene of a camera before triangles (world metres), `circle` the diameter on the film that counts as sharp, and `up` the world's
    /// upward direction.
    pub(crate) fn new(
        optics: &'a Optics,
        theme: &'a Theme,
        circle: f64,
        (section, up): (Section, DVec3),
        triangles: &[[DVec3; 3]],
        hidden: &'a BTreeSet<String>,
    ) -> Self {
        let plane = SectionPlane::new(optics, section);
        let world = optics.world_from_lens();
        let plane = if triangles.is_empty() { plane } else { plane.upright(world, up) }.told(world, up);
        Self::cut(optics, theme, circle, plane, triangles, hidden)
    }

    /// The same in a section that the kind chooses.
    pub(crate) fn cut(
        optics: &'a Optics,
        theme: &'a Theme,
        circle: f64,
        section: SectionPlane,
        triangles: &[[DVec3; 3]],
        hidden: &'a BTreeSet<String>,
    ) -> Self {
        let across = section.normal.cross(optics.axis());
        Self {
            optics,
            theme,
            depth: optics.depth_of_field(circle),
            film: extent::film_in_section(optics, &section),
            // Zero only where the axis is square to the section, which facing forward forbids.
            lens: across / across.length(),
            subject: subject::cut(triangles, optics.world_from_lens(), &section),
            bundles: Vec::new(),
            hidden,
            section,
        }
    }

    /// Whether a part is drawn.
    pub(crate) fn shows(&self, part: &str) -> bool {
        !self.hidden.contains(part)
    }
}

/// The parts that a figure can leave out by name. (Lens, film and their planes always stay.)
pub const PARTS: [&str; 18] = [
    "axis",
    "bellows",
    "caption",
    "dimension",
    "far-plane",
    "film-parallel",
    "focus-plane",
    "front-focal-plane",
    "hinge-line",
    "label",
    "lens-board",
    "near-plane",
    "ray",
    "ray-bundle",
    "scheimpflug-line",
    "scale",
    "subject",
    "wedge",
];

/// Draws everything of the section into a panel of this name. `mark` is the box that an inset enlarges and the lines
/// that lead to it.
///
/// # Errors
/// When a label has a character without a glyph.
pub(crate) fn panel(
    scene: &Scene,
    panel: Panel,
    role: Role,
    name: &'static str,
    mark: Option<(Shape, Vec<Shape>)>,
) -> Result<Group> {
    let mut canvas = Canvas::new(panel, scene.theme);
    if let Some((mark, connectors)) = mark {
        for connector in connectors {
            if let Geometry::Line(a, b) = connector.geometry {
                canvas.avoid(a, b, theme::HAIR, Weight::Soft);
            }
        }
        canvas.part("inset-mark", vec![mark]);
    }
    draw(scene, &mut canvas, role);
    close(scene, canvas, name)
}

/// Places the labels of a canvas and says where its points lie in the world.
///
/// # Errors
/// When a label has a character without a glyph.
pub(crate) fn close(scene: &Scene, mut canvas: Canvas, name: &'static str) -> Result<Group> {
    let world = scene.optics.world_from_lens();
    let (o, u, v) = (world.origin, world.vector(scene.section.u), world.vector(scene.section.v));
    let (s, [x, y]) = (canvas.panel.scale, canvas.panel.origin);
    if !scene.shows("label") {
        canvas.without_labels();
    }
    canvas.finish(PanelFrame {
        name,
        section: [o.x, o.y, o.z, u.x, u.y, u.z, v.x, v.y, v.z],
        page_from_section: [s, 0.0, 0.0, -s, x, y],
    })
}

/// What a panel is for: decides which labels it carries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Role {
    /// The only panel.
    Whole,
    /// The scene, the camera small in it.
    Main,
    /// The camera alone.
    Inset,
}

impl Role {
    pub(crate) fn names_camera(self) -> bool {
        self != Self::Main
    }

    pub(crate) fn names_scene(self) -> bool {
        self != Self::Inset
    }
}

/// Draws everything of the section into one panel.
pub(crate) fn draw(scene: &Scene, canvas: &mut Canvas, role: Role) {
    let optics = scene.optics;
    let theme = scene.theme;
    if scene.shows("wedge") {
        wedge(scene, canvas, role);
    }
    let subject = if scene.shows("subject") { draw_subject(scene, canvas) } else { None };
    if scene.shows("bellows") {
        bellows(scene, canvas);
    }
    for &point in scene.bundles.iter().filter(|_| scene.shows("ray-bundle")) {
        pencil(scene, canvas, point);
    }
    let hinge = scene.section.pierce(optics.hinge_line());
    let scheimpflug = scene.section.pierce(optics.scheimpflug_line());
    // Planes run to the line they share, where it is drawn.
    let to = |part: &str, line: Pierce| if scene.shows(part) { line } else { Pierce::AtInfinity };
    let toward_hinge = camera_span(scene, canvas, to("hinge-line", hinge));
    let toward_scheimpflug = camera_span(scene, canvas, to("scheimpflug-line", scheimpflug));
    let named = if role.names_camera() { long_enough(canvas, &toward_hinge) } else { toward_hinge };
    let thin = |hue: Hue| Style::plain(solid(hue.line, theme::THIN));
    let dashed = |hue: Hue| Style::plain(broken(hue.line, theme::THIN, theme::DASHED));
    let lens_plane =
        trace(scene, canvas, "lens-plane", optics.lens_plane(), thin(theme.lens), Some(&toward_scheimpflug));
    // Film that is shifted far stands elsewhere than the lens.
    let mut past_film = toward_scheimpflug.clone();
    past_film.extend(scene.film.into_iter().flatten().map(|p| canvas.panel.page(scene.section.project(p))));
    let film_plane =
        trace(scene, canvas, "film-plane", optics.film_plane(), thin(theme.film), Some(&past_film));
    let parallel = trace(
        scene,
        canvas,
        "film-parallel",
        optics.film_parallel_plane(),
        dashed(theme.hinge),
        Some(&named),
    );
    let focal = trace(
        scene,
        canvas,
        "front-focal-plane",
        optics.front_focal_plane(),
        dashed(theme.hinge),
        Some(&named),
    );
    if scene.shows("axis") {
        axis(scene, canvas, role);
    }
    let mut limits = Vec::new();
    for (part, plane) in
        [("near-plane", scene.depth.map(|d| d.near)), ("far-plane", scene.depth.map(|d| d.far))]
    {
        let Some(plane) = plane else { continue };
        let style = Style {
            front: solid(theme.depth.line, theme::MEDIUM),
            split: Some(scene.section.trace(optics.front_focal_plane())),
            behind_at_most: stub(scene, plane, 5.0),
            weight: Weight::Light,
        };
        limits.push((part, trace(scene, canvas, part, plane, style, None)));
    }
    let focus_style = Style {
        front: solid(theme.focus.line, 0.6),
        split: Some(scene.section.trace(optics.lens_plane())),
        behind_at_most: f64::INFINITY,
        weight: Weight::Heavy,
    };
    let focus = trace(scene, canvas, "focus-plane", optics.focus_plane(), focus_style, None);
    for &point in scene.bundles.iter().filter(|_| scene.shows("ray")) {
        rays(scene, canvas, point);
    }
    camera(scene, canvas, role);
    // Arrows and points first: they have the least freedom.
    line_point(
        scene,
        canvas,
        role,
        "scheimpflug-line",
        "Scheimpflug|line",
        optics.scheimpflug_line(),
        theme.lens,
    );
    line_point(scene, canvas, role, "hinge-line", "hinge line", optics.hinge_line(), theme.hinge);
    if role.names_scene() {
        match focus {
            Some((a, b)) => {
                let label = Label::new("focus plane", theme.focus.word, along(a, b));
                canvas.label(label.beside((a, b), 0.75));
            }
            None if scene.shows("focus-plane") => focus_arrow(scene, canvas, role),
            None => {}
        }
        for (part, ends) in limits {
            // Where the limit cannot be told from the focus plane, its name would only say that.
            let told = |(_, b): &(Point, Point)| focus.is_none_or(|(p, q)| beside(*b, p, q) > 0.8);
            if let Some((a, b)) = ends.filter(told) {
                let words = if part == "near-plane" { "near plane" } else { "far plane" };
                let toward = if part == "near-plane" { [0.0, -1.0] } else { [0.0, 1.0] };
                // Not next to the hinge, where all of them are near.
                let anchors = along(a, b).into_iter().take(5).collect();
                let label = Label::new(words, theme.depth.word, anchors).toward(toward);
                canvas.label(label.beside((a, b), 0.8));
            }
        }
    }
    if let Some(tops) = subject
        && role.names_scene()
    {
        canvas.label(Label::new("subject", theme.subject.word, tops).toward([0.0, -1.0]).optional());
    }
    if let Pierce::At(p) = hinge
        && role.names_scene()
        && ["dimension", "film-parallel", "hinge-line"].iter().all(|part| scene.shows(part))
    {
        distance_j(scene, canvas, p);
    }
    if role.names_camera() {
        // To the plane that it ends at.
        if scene.shows("dimension") && scene.shows("front-focal-plane") {
            dimension_f(scene, canvas);
        }
        let name = |canvas: &mut Canvas, ends: Option<(Point, Point)>, words: &str, hue: Hue, at: f64| {
            if let Some((a, b)) = ends {
                let anchors =
                    [at, 0.15 + 0.7 * at, 1.0 - at, 0.85 - 0.7 * at, 0.3 + 0.4 * at, 0.7 - 0.4 * at, 0.5]
                        .map(|t| [a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t]);
                canvas.label(Label::new(words, hue.word, anchors.to_vec()).beside((a, b), at));
            }
        };
        let tilted = optics.axis().cross(optics.film_normal()).length() > 1e-3;
        if tilted {
            name(canvas, parallel, "film-parallel|plane", theme.hinge, 0.05);
        }
        name(canvas, focal, "front focal|plane", theme.hinge, 0.05);
        name(canvas, lens_plane, "lens|plane", theme.lens, 0.95);
        name(canvas, film_plane, "film|plane", theme.film, 0.95);
    }
}

/// How far a page point lies from the line through two others.
fn beside(p: Point, a: Point, b: Point) -> f64 {
    let (x, y) = (b[0] - a[0], b[1] - a[1]);
    ((p[0] - a[0]) * y - (p[1] - a[1]) * x).abs() / libm::hypot(x, y).max(1e-12)
}

/// The larger of film and lens in the section, metres.
pub(crate) fn camera_height(scene: &Scene) -> f64 {
    let film = scene.film.map_or(0.0, |[p, q]| (q - p).length());
    film.max(2.0 * scene.optics.aperture_radius()).max(0.2 * scene.optics.focal_length())
}
