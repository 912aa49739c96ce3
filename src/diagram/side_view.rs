//! The first figure: a camera's section with its planes and lines. In: optics, circle of confusion, subject.
//! Out: a [`Figure`]: a main panel to scale, the camera at its own scale beside it, and the numbers in words.

use super::Figure;
use super::canvas::{self, Canvas};
use super::display_list::{DisplayList, Face, Geometry, Group, Item, PanelFrame, Point, Run, Shape, Text};
use super::extent::{self, Extent};
use super::facts;
use super::lettering;
use super::panel::Panel;
use super::parts::{self, Role, Scene};
use super::place::Weight;
use super::rays;
use super::section::{Section, SectionPlane, View};
use super::subject;
use super::theme::{self, Theme};
use super::words;
use crate::error::{Error, Result};
use crate::optics::Optics;
use glam::DVec3;

/// Whether the camera is drawn a second time at its own scale.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Inset {
    /// When it is too small to read in the main panel.
    #[default]
    Auto,
    /// In any case.
    Always,
    /// In no case.
    Never,
}

/// Page millimetres below which the camera is too small to read.
const READABLE: f64 = 24.0;
const MARGIN: f64 = 2.5;
const STRIP: f64 = 5.0;
const GUTTER: f64 = 4.5;
const INSET_WIDTH: f64 = 62.0;
const LEADING: f64 = 3.9;

/// Where panels and captions stand when the camera is drawn twice.
struct Layout {
    main: Panel,
    inset: Panel,
    /// Left and top of the facts.
    block: Point,
    lines: Vec<String>,
    stacked: bool,
}

/// A side view to be drawn: set what shall be in it, then ask for the [`Figure`].
///
/// ```
/// # use groundglass::{camera::*, diagram::{Figure, Inset, SideView}, geometry::Pose, optics::Optics, quantity::*};
/// # let camera = Camera {
/// #     rail: Pose { origin: glam::DVec3::ZERO, axes: glam::DMat3::IDENTITY },
/// #     front: Standard { tilt: Angle::degrees(6.0), ..Standard::default() },
/// #     rear: Standard::default(),
/// #     extension: Length::millimetres(152.3),
/// #     focal_length: Length::millimetres(150.0),
/// #     aperture: Aperture::FNumber(FNumber::new(16.0)?),
/// #     film: FilmSize::named("4x5")?,
/// #     near: Length::millimetres(15.0),
/// # };
/// let optics = Optics::new(&camera)?;
/// let figure = SideView::new(&optics).circle_of_confusion(1e-4).inset(Inset::Auto).figure()?;
/// assert!(figure.to_svg()?.contains("data-part=\"hinge-line\""));
/// # Ok::<(), groundglass::error::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct SideView<'a> {
    optics: &'a Optics,
    circle: f64,
    triangles: &'a [[DVec3; 3]],
    section: Section,
    inset: Inset,
    title: Option<&'a str>,
    page: [f64; 2],
    background: bool,
    theme: Theme,
}

impl<'a> SideView<'a> {
    /// A side view of a camera with no subject, the circle of confusion 1/1500 of the film's diagonal.
    pub fn new(optics: &'a Optics) -> Self {
        Self {
            optics,
            circle: optics.camera().film.diagonal() / 1500.0,
            triangles: &[],
            section: Section::Auto,
            inset: Inset::Auto,
            title: None,
            page: [160.0, 100.0],
            background: true,
            theme: Theme::PRINT,
        }
    }

    /// Diameter of the circle of confusion in metres, on the film.
    #[must_use]
    pub fn circle_of_confusion(self, metres: f64) -> Self {
        Self { circle: metres, ..self }
    }

    /// The subject as triangles in world metres; the figure shows where the section cuts them.
    #[must_use]
    pub fn subject(self, triangles: &'a [[DVec3; 3]]) -> Self {
        Self { triangles, ..self }
    }

    /// Which section is shown.
    #[must_use]
    pub fn section(self, section: Section) -> Self {
        Self { section, ..self }
    }

    /// Whether the camera is drawn at its own scale too.
    #[must_use]
    pub fn inset(self, inset: Inset) -> Self {
        Self { inset, ..self }
    }

    /// A title over the figure.
    #[must_use]
    pub fn title(self, title: &'a str) -> Self {
        Self { title: Some(title), ..self }
    }

    /// Width and height of the page in millimetres; 160 by 100 unless set.
    #[must_use]
    pub fn page(self, width: f64, height: f64) -> Self {
        Self { page: [width, height], ..self }
    }

    /// Whether the page is painted; without, it is transparent.
    #[must_use]
    pub fn background(self, painted: bool) -> Self {
        Self { background: painted, ..self }
    }

    /// The colours.
    #[must_use]
    pub fn theme(self, theme: Theme) -> Self {
        Self { theme, ..self }
    }

    /// Draws it.
    ///
    /// # Errors
    /// When the page is smaller than 130 by 80 mm or larger than 2000 mm, the circle of confusion is not positive,
    /// the title has a character without a glyph, or the camera's numbers are too extreme to be drawn.
    pub fn figure(&self) -> Result<Figure> {
        let [width, height] = self.page;
        if !((130.0..=2000.0).contains(&width) && (80.0..=2000.0).contains(&height)) {
            return Err(Error::invalid(format!("a page of {width} by {height} mm cannot hold this figure"))
                .remedy("choose 130 to 2000 mm by 80 to 2000 mm"));
        }
        if !(self.circle > 0.0 && self.circle.is_finite()) {
            return Err(Error::invalid("the circle of confusion must be positive")
                .at_key("focus.circle_of_confusion_mm"));
        }
        let mut scene = self.scene();
        let extent = Extent::of(&scene);
        if !extent.is_finite() {
            return Err(Error::invalid("the camera's numbers are too extreme to be drawn")
                .remedy("check extension_mm, film_mm and the rises and shifts"));
        }
        let top = MARGIN + if self.title.is_some() { theme::TITLE * 1.7 } else { 0.0 };
        let facts = facts::lines(&scene, self.circle);
        let wide_lines = flow(&facts, width - 2.0 * MARGIN)?;
        let foot = LEADING * wide_lines.len() as f64 + 1.0;
        let whole = [MARGIN, top, width - MARGIN, height - MARGIN - STRIP - foot];
        let alone = extent::fit(extent.scene, whole, 5.0);
        let readable = extent.camera_size() * alone.scale >= READABLE;
        let with_inset = match self.inset {
            Inset::Always => true,
            Inset::Never => false,
            Inset::Auto => !readable,
        };
        let mut items = Vec::new();
        if let Some(title) = self.title {
            let runs = vec![Run { text: title.to_owned(), face: Face::Regular }];
            items.push(caption("title", runs, [MARGIN, MARGIN + theme::TITLE], theme::TITLE, &self.theme)?);
        }
        if with_inset {
            let layout = self.layout(&extent, top, &facts)?;
            scene.bundles = rays::bundles(&scene, &layout.main);
            let (mark, connectors) = inset_mark(&layout.main, &layout.inset, &self.theme);
            let lines = Item::Group(Group::of("inset-mark", connectors.clone().map(Item::Shape).to_vec()));
            items.push(lines);
            items.push(Item::Group(self.panel(
                &scene,
                layout.main,
                Role::Main,
                "main",
                Some((mark, connectors)),
            )?));
            items.push(Item::Group(self.panel(&scene, layout.inset, Role::Inset, "inset", None)?));
            self.strip(&mut items, &layout.inset, "camera", false)?;
            self.strip(&mut items, &layout.main, view_name(scene.section.view), layout.stacked)?;
            self.block(&mut items, &layout.lines, layout.block)?;
        } else {
            scene.bundles = rays::bundles(&scene, &alone);
            items.push(Item::Group(self.panel(&scene, alone, Role::Whole, "main", None)?));
            self.strip(&mut items, &alone, view_name(scene.section.view), false)?;
            self.block(&mut items, &wide_lines, [MARGIN, height - MARGIN - foot + 1.0])?;
        }
        let title = self.title.unwrap_or(view_title(scene.section.view)).to_owned();
        let list = DisplayList {
            page: self.page,
            background: self.background.then_some(self.theme.paper),
            title,
            description: facts::describe(&scene, self.circle),
            items,
        };
        Figure::new(list)
    }

    /// Side by side, or one above the other where that shows a long low scene much larger.
    fn layout(&self, extent: &Extent, top: f64, facts: &[String]) -> Result<Layout> {
        let [width, height] = self.page;
        let (right, bottom) = (width - MARGIN, height - MARGIN);
        let beside = {
            let lines = flow(facts, INSET_WIDTH)?;
            let foot = LEADING * lines.len() as f64 + 2.0;
            let left = MARGIN + INSET_WIDTH + GUTTER;
            let low = bottom - STRIP - foot;
            Layout {
                main: extent::fit(extent.scene, [left, top, right, bottom - STRIP], 6.0),
                inset: extent::fit(extent.camera, [MARGIN, top, MARGIN + INSET_WIDTH, low], 5.0),
                block: [MARGIN, low + STRIP + 2.0],
                lines,
                stacked: false,
            }
        };
        let stacked = {
            let split = top + 0.46 * (bottom - top);
            let across = MARGIN + 0.52 * (width - 2.0 * MARGIN);
            let lines = flow(facts, right - across - GUTTER)?;
            let inset = [MARGIN, split + STRIP + 2.5, across, bottom - STRIP];
            Layout {
                main: extent::fit(extent.scene, [MARGIN, top, right, split], 5.0),
                inset: extent::fit(extent.camera, inset, 4.5),
                block: [across + GUTTER, split + STRIP + 2.5],
                lines,
                stacked: true,
            }
        };
        let better = stacked.main.scale >= 1.45 * beside.main.scale;
        let room = LEADING * stacked.lines.len() as f64 <= bottom - stacked.block[1];
        Ok(if better && room { stacked } else { beside })
    }

    fn scene(&self) -> Scene<'_> {
        let optics = self.optics;
        let section = SectionPlane::new(optics, self.section);
        let across = section.normal.cross(optics.axis());
        Scene {
            optics,
            theme: &self.theme,
            depth: optics.depth_of_field(self.circle),
            film: extent::film_in_section(optics, &section),
            // Zero only where the axis is square to the section, which facing forward forbids.
            lens: across / across.length(),
            subject: subject::cut(self.triangles, optics.world_from_lens(), &section),
            bundles: Vec::new(),
            section,
        }
    }

    fn panel(
        &self,
        scene: &Scene,
        panel: Panel,
        role: Role,
        name: &'static str,
        mark: Option<(Shape, [Shape; 2])>,
    ) -> Result<Group> {
        let mut canvas = Canvas::new(panel, &self.theme);
        if let Some((mark, connectors)) = mark {
            for connector in connectors {
                if let Geometry::Line(a, b) = connector.geometry {
                    canvas.avoid(a, b, theme::HAIR, Weight::Soft);
                }
            }
            canvas.part("inset-mark", vec![mark]);
        }
        parts::draw(scene, &mut canvas, role);
        let world = self.optics.world_from_lens();
        let (o, u, v) = (world.origin, world.vector(scene.section.u), world.vector(scene.section.v));
        let s = panel.scale;
        canvas.finish(PanelFrame {
            name,
            section: [o.x, o.y, o.z, u.x, u.y, u.z, v.x, v.y, v.z],
            page_from_section: [s, 0.0, 0.0, -s, panel.origin[0], panel.origin[1]],
        })
    }

    /// Under a panel: what it shows, its scale in numbers and as a bar.
    fn strip(&self, items: &mut Vec<Item>, panel: &Panel, words: &str, to_right: bool) -> Result<()> {
        let [left, _, right, bottom] = panel.frame;
        let base = bottom + 3.4;
        let scale = words::ratio(1000.0 / panel.scale);
        let said = lettering::runs(&format!("{words}, {scale}"));
        let metres = words::round_length(22.0 / panel.scale);
        let long = metres * panel.scale;
        let label = lettering::runs(&words::length(metres));
        let width = lettering::width(&label)? * theme::LETTER;
        let at = right - long - 1.5 - width;
        let begin = if to_right { at - 6.0 - lettering::width(&said)? * theme::LETTER } else { left };
        items.push(caption("scale", said, [begin, base], theme::LETTER, &self.theme)?);
        items.push(caption("scale", label, [at, base], theme::LETTER, &self.theme)?);
        let stroke = theme::solid(self.theme.ink, theme::MEDIUM);
        let y = base - 0.9;
        let bar = [
            Shape::line([right - long, y], [right, y], stroke),
            Shape::line([right - long + 0.15, y - 0.9], [right - long + 0.15, y + 0.9], stroke),
            Shape::line([right - 0.15, y - 0.9], [right - 0.15, y + 0.9], stroke),
        ];
        items.push(Item::Group(Group::of("scale-bar", bar.into_iter().map(Item::Shape).collect())));
        Ok(())
    }

    /// Lines of text from a height on.
    fn block(&self, items: &mut Vec<Item>, lines: &[String], at: Point) -> Result<()> {
        let mut base = at[1] + lettering::ASCENT * theme::LETTER;
        for line in lines {
            items.push(caption("caption", lettering::runs(line), [at[0], base], theme::LETTER, &self.theme)?);
            base += LEADING;
        }
        Ok(())
    }
}

fn caption(part: &'static str, runs: Vec<Run>, at: Point, size: f64, theme: &Theme) -> Result<Item> {
    let width = lettering::width(&runs)? * size;
    let bounds = [at[0], at[1] - lettering::ASCENT * size, at[0] + width, at[1] + lettering::DESCENT * size];
    Ok(Item::Group(Group::of(part, vec![Item::Text(Text { at, size, color: theme.ink, runs, bounds })])))
}

fn view_name(view: View) -> &'static str {
    match view {
        View::Side => "side view",
        View::Top => "top view",
        View::Oblique => "oblique section",
    }
}

fn view_title(view: View) -> &'static str {
    match view {
        View::Side => "View camera, side view",
        View::Top => "View camera, top view",
        View::Oblique => "View camera, oblique section",
    }
}

/// Facts joined to lines of at most this width (mm).
fn flow(facts: &[String], width: f64) -> Result<Vec<String>> {
    let mut lines: Vec<String> = Vec::new();
    for fact in facts {
        if let Some(last) = lines.last_mut() {
            let joined = format!("{last} · {fact}");
            if canvas::size(&joined)?[0] <= width {
                *last = joined;
                continue;
            }
        }
        lines.push(fact.clone());
    }
    Ok(lines)
}

/// The box in the main panel that the inset enlarges, and the lines from it to the inset.
fn inset_mark(main: &Panel, inset: &Panel, theme: &Theme) -> (Shape, [Shape; 2]) {
    let shrink = main.scale / inset.scale;
    let at = |x: f64, y: f64| {
        [main.origin[0] + shrink * (x - inset.origin[0]), main.origin[1] + shrink * (y - inset.origin[1])]
    };
    let (p, q) = (at(inset.frame[0], inset.frame[1]), at(inset.frame[2], inset.frame[3]));
    let l = p[0].max(main.frame[0]);
    let (t, r, b) = (p[1].max(main.frame[1]), q[0].min(main.frame[2]), q[1].min(main.frame[3]));
    let stroke = theme::solid(theme.faint, theme::HAIR);
    let mark = Shape::polyline(&[[l, t], [r, t], [r, b], [l, b]], true, None, Some(stroke));
    let [il, it, ir, ib] = inset.frame;
    let lines = if it > main.frame[3] {
        [Shape::line([il, it], [l, b], stroke), Shape::line([ir, it], [r, b], stroke)]
    } else {
        [Shape::line([ir, it], [l, t], stroke), Shape::line([ir, ib], [l, b], stroke)]
    };
    (mark, lines)
}
