//! `kind = "side-view"`: a camera's section with its planes and lines. In: optics, circle of confusion, subject.
//! Out: a [`Figure`]: a main panel to scale, the camera at its own scale beside it, and the numbers in words.

use super::file::Input;
use super::keys;
use crate::diagram::Figure;
use crate::diagram::display_list::{Group, Item, Point, Shape};
use crate::diagram::extent::{self, Extent};
use crate::diagram::facts;
use crate::diagram::panel::Panel;
use crate::diagram::parts::{self, PARTS, Role, Scene};
use crate::diagram::rays;
use crate::diagram::section::{Section, View};
use crate::diagram::sheet::{self, GUTTER, LEADING, MARGIN, STRIP, Sheet};
use crate::diagram::theme::{self, Theme};
use crate::error::{Error, Result};
use crate::optics::Optics;
use glam::DVec3;
use schemars::JsonSchema;
use serde::Deserialize;
use std::collections::BTreeSet;

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
const INSET_WIDTH: f64 = 62.0;
/// The least height of a panel of the camera alone, in which its parts and names stand.
const INSET_HEIGHT: f64 = 18.0;
/// From this width on (mm) panels stand beside one another.
const WIDE: f64 = 130.0;

/// What a figure file of this kind says beside page and camera.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(default)]
pub(crate) struct Keys {
    /// The plane of the section: `auto` holds the normals of lens and film, `side` is upright along the rail, `top` level.
    #[schemars(extend("enum" = ["auto", "side", "top"]), example = &"auto")]
    section: String,
    /// A panel beside, to its own scale, that shows the camera itself: `auto` where it is too small to be read.
    #[schemars(extend("enum" = ["auto", "always", "never"]), example = &"auto")]
    inset: String,
    /// The only parts drawn of those that can be left out, by name; `label`, `caption` and `scale` are such parts too. All of
    /// them unless given.
    #[schemars(schema_with = "keys::part_names")]
    show: Option<Vec<String>>,
    /// Parts left out, by name.
    #[schemars(schema_with = "keys::part_names")]
    hide: Vec<String>,
}

impl Default for Keys {
    fn default() -> Self {
        Self { section: "auto".into(), inset: "auto".into(), show: None, hide: Vec::new() }
    }
}

/// Draws the figure that a file describes.
pub(crate) fn draw(input: &Input) -> Result<Figure> {
    let (page, keys) = (input.page(height)?, input.keys::<Keys>()?);
    let names = |parts: &Vec<String>| parts.iter().any(|part| part == "subject");
    let shows_subject = keys.show.as_ref().is_none_or(names) && !names(&keys.hide);
    let subject = input.camera(shows_subject)?;
    let mut view = SideView::new(&subject.optics)
        .circle_of_confusion(subject.circle)
        .subject(&subject.triangles)
        .up(subject.up)
        .section(input.changes.section.unwrap_or(match keys.section.as_str() {
            "side" => Section::Side,
            "top" => Section::Top,
            _ => Section::Auto,
        }))
        .inset(input.changes.inset.unwrap_or(match keys.inset.as_str() {
            "always" => Inset::Always,
            "never" => Inset::Never,
            _ => Inset::Auto,
        }))
        .show(keys.show.as_deref().unwrap_or(&PARTS.map(str::to_owned)))
        .hide(&keys.hide)
        .page(page.size[0], page.size[1])
        .background(page.background)
        .theme(page.theme);
    if let Some(title) = &page.title {
        view = view.title(title);
    }
    view.figure()
}

/// The height of a page of this width, unless one is given.
fn height(width: f64) -> f64 {
    if width < WIDE { 1.25 * width } else { 0.625 * width }
}

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
///
/// [`Figure::side_view`] shows such a figure.
#[derive(Clone, Debug)]
pub struct SideView<'a> {
    optics: &'a Optics,
    circle: f64,
    triangles: &'a [[DVec3; 3]],
    up: DVec3,
    section: Section,
    inset: Inset,
    title: Option<&'a str>,
    page: [f64; 2],
    background: bool,
    theme: Theme,
    hidden: BTreeSet<String>,
    /// A name that is none of a part, if there was one.
    unknown: Option<String>,
}

impl<'a> SideView<'a> {
    /// A side view of a camera with no subject, the circle of confusion 1/1500 of the film's diagonal.
    pub fn new(optics: &'a Optics) -> Self {
        Self {
            optics,
            circle: optics.camera().film.usual_circle(),
            triangles: &[],
            up: DVec3::Y,
            section: Section::Auto,
            inset: Inset::Auto,
            title: None,
            page: [160.0, 100.0],
            background: true,
            theme: Theme::PRINT,
            hidden: BTreeSet::new(),
            unknown: None,
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

    /// The world's upward direction; +Y by default. A side view of a subject stands upright by it.
    #[must_use]
    pub fn up(self, up: DVec3) -> Self {
        Self { up, ..self }
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

    /// Width of the page in millimetres, 160 unless set; the height suits it.
    #[must_use]
    pub fn page_width(self, width: f64) -> Self {
        self.page(width, height(width))
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

    /// Draws only these of the parts that can be left out, by name; [`PARTS`] lists those, and all are drawn unless this is
    /// called.
    #[must_use]
    pub fn show<S: AsRef<str>>(mut self, parts: &[S]) -> Self {
        self.known(parts);
        let wanted = |name: &&&str| parts.iter().any(|part| part.as_ref() == **name);
        self.hidden = PARTS.iter().filter(|name| !wanted(name)).map(|name| (*name).to_owned()).collect();
        self
    }

    /// Leaves out parts by name; [`PARTS`] lists those that can be.
    #[must_use]
    pub fn hide<S: AsRef<str>>(mut self, parts: &[S]) -> Self {
        self.known(parts);
        self.hidden.extend(parts.iter().map(|part| part.as_ref().to_owned()));
        self
    }

    fn known<S: AsRef<str>>(&mut self, parts: &[S]) {
        let unknown = parts.iter().map(AsRef::as_ref).find(|part| !PARTS.contains(part));
        self.unknown = self.unknown.take().or(unknown.map(str::to_owned));
    }

    /// Draws it.
    ///
    /// # Errors
    /// When the page is smaller than 60 by 40 mm or larger than 2000 mm or too small for what is asked for, the circle of confusion is not positive,
    /// the title has a character without a glyph, a part has no such name, what is up has no direction, a corner of the subject is no number, or
    /// the camera's numbers are too extreme to be drawn.
    pub fn figure(&self) -> Result<Figure> {
        let mut sheet = Sheet::new(self.page, [60.0, 40.0], &self.theme)?;
        sheet.background = self.background;
        sheet.with_scale = !self.hidden.contains("scale");
        let [width, height] = self.page;
        if !(self.circle > 0.0 && self.circle.is_finite()) {
            return Err(Error::invalid("the circle of confusion must be positive")
                .at_key("focus.circle_of_confusion_mm"));
        }
        if let Some(name) = &self.unknown {
            return Err(Error::invalid(format!("a side view has no part `{name}`"))
                .remedy(format!("name some of {}", PARTS.join(", "))));
        }
        if !(self.up.is_finite() && self.up != DVec3::ZERO) {
            return Err(Error::invalid("what is up has no direction")
                .remedy("give a vector that is finite and not zero"));
        }
        if !self.triangles.as_flattened().iter().all(|corner| corner.is_finite()) {
            return Err(
                Error::invalid("a corner of the subject is no number").remedy("leave its triangle out")
            );
        }
        let mut scene = self.scene();
        let extent = Extent::of(&scene);
        if !extent.is_finite() {
            return Err(Error::invalid("the camera's numbers are too extreme to be drawn")
                .remedy("check extension_mm, film_mm and the rises and shifts"));
        }
        let top = sheet.heading(self.title)?;
        let facts = if scene.shows("caption") { facts::lines(&scene, self.circle) } else { Vec::new() };
        let wide_lines = sheet::flow(&facts, width - 2.0 * MARGIN)?;
        let foot = if facts.is_empty() { 0.0 } else { LEADING * wide_lines.len() as f64 + 1.0 };
        let whole = [MARGIN, top, width - MARGIN, height - MARGIN - STRIP - foot];
        if whole[3] - whole[1] < 20.0 {
            return Err(Error::invalid(format!("a page of {width} by {height} mm cannot hold this figure"))
                .at_key("height_mm")
                .remedy("give more height, or leave out the title and the caption"));
        }
        let alone = extent::fit(extent.scene, whole, if width < WIDE { 4.0 } else { 5.0 });
        let readable = extent.camera_size() * alone.scale >= READABLE;
        let with_inset = match self.inset {
            Inset::Always => true,
            Inset::Never => false,
            Inset::Auto => !readable,
        };
        let layout = if with_inset { self.layout(&extent, top, &facts)? } else { None };
        // An enlargement that is none only takes room.
        let is_needless = layout.as_ref().is_some_and(|layout| layout.inset.scale <= alone.scale);
        let layout = layout.filter(|_| !is_needless);
        let view = scene.section.name();
        if let Some(layout) = layout {
            scene.bundles = rays::bundles(&scene, &layout.main);
            let (mark, connectors) = inset_mark(&layout.main, &layout.inset, &self.theme);
            // In a narrow page they would run through the words under the main panel.
            let connectors = if width < WIDE { Vec::new() } else { connectors.to_vec() };
            sheet.push(Group::of("inset-mark", connectors.iter().cloned().map(Item::Shape).collect()));
            sheet.push(parts::panel(&scene, layout.main, Role::Main, "main", Some((mark, connectors)))?);
            sheet.push(parts::panel(&scene, layout.inset, Role::Inset, "inset", None)?);
            sheet.strip(&layout.inset, "camera", false)?;
            sheet.strip(&layout.main, view, layout.stacked)?;
            sheet.block(&layout.lines, layout.block)?;
        } else {
            scene.bundles = rays::bundles(&scene, &alone);
            sheet.push(parts::panel(&scene, alone, Role::Whole, "main", None)?);
            if self.inset == Inset::Always {
                let why = if is_needless { "needless" } else { "beyond" };
                sheet.push(Group::off_page("camera-panel", why));
            }
            sheet.strip(&alone, view, false)?;
            sheet.block(&wide_lines, [MARGIN, height - MARGIN - foot + 1.0])?;
        }
        sheet.finish(view_title(scene.section.view), facts::describe(&scene, self.circle))
    }

    /// Side by side, or one above the other where that shows a long low scene much larger.
    /// A narrow page has all below one another.
    fn layout(&self, extent: &Extent, top: f64, facts: &[String]) -> Result<Option<Layout>> {
        let [width, height] = self.page;
        let (right, bottom) = (width - MARGIN, height - MARGIN);
        if width < WIDE {
            let lines = sheet::flow(facts, right - MARGIN)?;
            let foot = if lines.is_empty() { 0.0 } else { LEADING * lines.len() as f64 + 1.0 };
            let low = bottom - foot - STRIP;
            let split = top + 0.45 * (low - STRIP - 2.0 - top);
            let inset = [MARGIN, split + STRIP + 2.0, right, low];
            return Ok((inset[3] - inset[1] > 25.0 && split - top > 25.0).then(|| Layout {
                main: extent::fit(extent.scene, [MARGIN, top, right, split], 4.0),
                inset: extent::fit(extent.camera, inset, 4.0),
                block: [MARGIN, bottom - foot + 1.0],
                lines,
                stacked: false,
            }));
        }
        let beside = {
            let lines = sheet::flow(facts, INSET_WIDTH)?;
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
            let lines = sheet::flow(facts, right - across - GUTTER)?;
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
        let fits = |layout: &Layout| layout.inset.height() >= INSET_HEIGHT;
        let chosen = if better && room && fits(&stacked) { stacked } else { beside };
        Ok(Some(chosen).filter(fits))
    }

    fn scene(&self) -> Scene<'_> {
        Scene::new(
            self.optics,
            &self.theme,
            self.circle,
            (self.section, self.up),
            self.triangles,
            &self.hidden,
        )
    }
}

fn view_title(view: View) -> &'static str {
    match view {
        View::Side => "View camera, side view",
        View::Top => "View camera, top view",
        View::Oblique => "View camera, oblique section",
    }
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
