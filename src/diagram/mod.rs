//! Diagrams: from one camera's [`Optics`] to a drawing in SVG, PDF or pixels.
//!
//! ```text
//! figure file --figures--> what shall be drawn, of which camera
//! Optics --section--> traces and points in section metres --panel--> page millimetres
//!        --canvas, place--> DisplayList (all decisions taken) --paint--> SVG | PDF | pixels
//! ```
//!
//! Every drawn part is a group with `data-part`. Besides the contract's names (`lens`, `film`, `axis`, `focus-plane`,
//! `lens-plane`, `film-plane`, `scheimpflug-line`, `hinge-line`, `front-focal-plane`, `film-parallel`, `near-plane`,
//! `far-plane`, `wedge`, `ray`, `subject`, `label`) there are:
//!
//! | name | what it is |
//! |---|---|
//! | `axis-projected` | the lens axis seen square to a section that does not hold it |
//! | `ray-bundle` | the area between the outermost rays of a bundle |
//! | `bellows`, `lens-board` | the camera's body, a symbol without measure |
//! | `arrow` | at a panel's border: the way to a line or plane that lies off it |
//! | `dimension` | a measured length: the focal length, from lens to front focal plane; J, to the hinge line |
//! | `leader` | from labels to what they name |
//! | `inset-mark` | which part of the main panel the inset enlarges |
//! | `frame` | a panel's border |
//! | `scale`, `scale-bar` | a panel's scale in words and drawn; `panel-title`: its words alone |
//! | `title`, `caption`, `paper` | words about the figure, its ground |
//! | `angle`, `right-angle` | an angle's arc, the mark of a right one |
//! | `blur-contour` | where the exact blur has the size `data-blur`, metres, or `data-circles` circles of confusion; `difference` marks a point, with `data-percent`; `picture-edge`: rays from the film's ends through the lens centre |
//! | `merklinger-near`, `-far`, `untilted-near`, `-far` | limits as textbooks have them |
//! | `limit-ray`, `limit-image`, `circle-of-confusion`, `chief-ray` | the limits' cones of light at the film, enlarged |
//! | `lens-sample`, `lens-axes`, `aperture-circle` | points of the aperture, its axes, the circle about its blades |
//! | `seen-ray`, `far-wall`, `point`, `film-rows`, `film-images`, `sum` | how pictures through lens points add up |
//! | `sight`, `camera-place`, `film-picture`, `front-edges`, `front-lines`, `film-frame` | a front before the camera, and on its film |
//! | `wanted-plane`, `nearest-plane`, `limit-circle`, `limit-plane`, `plane-distance`, `impossible-hinge`, `impossible-point` | what a solver was asked for, and its limit |
//! | `before`, `movement` | where a standard stood, and the way it went |
//!
//! Where a figure has several cameras a part says whose it is: `data-extension-mm`, `data-tilt-deg`, `data-f-number`.
//!
//! Charts (`kind = "plot"`) have no panel. Their group `chart` says with `data-x` and `data-y` how its axes run (`log a b`:
//! page = a + b log10(value); `linear a b`: page = a + b value) and holds `grid`, `tick`, `tick-label`, `axis-title`,
//! `guide`, `legend` and, with `data-series`, `data-x` and `data-y` (the values), each `series` of `line`, `marker`
//! and `error-bar`. Heat maps (`kind = "heat-map"`) are such charts side by side; each has `cells` with `data-series`.
//!
//! `data-off-page` says why a part's group is empty: `beyond` the panel's frame, `behind` the lens or its front focal plane and along them
//! (a far limit beyond infinity), `at-infinity`, `parallel` to the section, `not-cut` by it, `thin`: too thin to be seen, `needless`: no
//! larger than elsewhere; of a `label`, `no-room` for the words in `data-words`.
//!
//! The name of a plane seen edge-on runs along its trace. In a panel nothing carries `transform`, so such a label is made of
//! turned outlines; with `--text text` it is a `label` that follows its panel, and its `<text>` carries the turn.

mod bodies;
mod canvas;
mod contour;
mod display_list;
mod extent;
mod facts;
mod figures;
mod lettering;
mod lines;
mod marks;
mod paint;
mod panel;
mod parts;
mod place;
mod planes;
mod rays;
mod room;
mod section;
mod sheet;
mod subject;
mod theme;
mod whereabouts;
mod words;

pub use display_list::{
    Color, DisplayList, Face, Fill, Geometry, Group, Item, PanelFrame, Point, Raster, Recoloring, Run,
    Script, Segment, Shape, Stroke, Text,
};
pub use figures::file::{Changes, FigureFile};
pub use figures::keys::PAGE_WIDTHS;
pub use figures::side_view::{Inset, SideView};
pub use figures::{KINDS, Kind, schema};
pub use paint::svg::TextAs;
pub use parts::PARTS;
pub use section::Section;
pub use theme::{Adapts, Hue, THEMES, Theme};

use crate::error::{Error, Result, Warning};
use crate::optics::Optics;

/// A finished drawing: a display list and the ways to paint it.
///
/// # Guarantees
/// Every coordinate is finite, every character has a glyph, and the same figure gives the same bytes everywhere.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    list: DisplayList,
    warnings: Vec<Warning>,
}

impl Figure {
    /// Begins a side view of a camera; see [`SideView`] for what can be set.
    ///
    /// ```
    /// use groundglass::{diagram::Figure, optics::Optics, scene};
    ///
    /// let camera = "[camera]\neye_m = [0, 1.6, 0]\nlook_at_m = [0, 1.6, -10]\nfocal_length_mm = 150\nf_number = 16\n\
    ///               film = '4x5'\nextension_mm = 152.3\n[camera.front]\ntilt_deg = 6";
    /// let optics = scene::parse(camera, "tilted.toml")?.describe()?.optics()?;
    /// let figure = Figure::side_view(&optics).title("Lens tilt").figure()?;
    /// let (for_the_web, for_print) = (figure.to_svg()?, figure.to_pdf()?);
    /// # assert!(for_the_web.contains("data-part=\"hinge-line\"") && for_print.starts_with(b"%PDF"));
    /// # Ok::<(), groundglass::Error>(())
    /// ```
    ///
    #[doc = include_str!("../../diagrams/side-view.svg")]
    pub fn side_view(optics: &Optics) -> SideView<'_> {
        SideView::new(optics)
    }

    fn new(list: DisplayList) -> Result<Self> {
        if list.items.iter().all(finite) {
            Ok(Self { list, warnings: Vec::new() })
        } else {
            Err(Error::invalid("the camera's numbers are too extreme to be drawn")
                .remedy("check the lengths and angles of the camera"))
        }
    }

    /// What a figure file asks for and the figure does not show, or shows of a camera that no scene could be rendered
    /// with.
    pub fn warnings(&self) -> &[Warning] {
        &self.warnings
    }

    /// What a reader would look for and not find, in words: parts that lie off the page, and labels for which it has no room.
    pub fn not_shown(&self) -> Vec<String> {
        let parts = beyond(&self.list.items).into_iter().map(|(part, why, whose)| match part {
            "film" if why == "not-cut" => {
                format!(
                    "the film{whose} lies beside this section, which does not cut it: see another section"
                )
            }
            "wedge" if why == "thin" => format!("the wedge{whose} is too thin to be drawn"),
            "camera-panel" if why == "needless" => {
                "a panel of the camera alone would show it no larger: none is drawn".to_owned()
            }
            "some-points" => "points lie off the chart".to_owned(),
            "some-bars" => "error bars run off the chart".to_owned(),
            "camera-panel" => {
                "there is no room for the panel of the camera alone: give a higher page".to_owned()
            }
            "some-guides" => "guides lie off the chart".to_owned(),
            "some-of-front" => "some of the front lies off the film".to_owned(),
            part => format!("the {}{whose} lies off the page", part.replace('-', " ")),
        });
        let mut all: Vec<String> = parts.collect();
        walk(&self.list.items, &mut |group| {
            if group.off_page == Some("no-room") {
                let words = group.data.iter().filter(|(name, _)| *name == "data-words");
                all.extend(words.map(|(_, said)| {
                    format!("there is no room for the words \"{said}\": give a wider page")
                }));
            }
        });
        all
    }

    /// What is drawn.
    pub fn display_list(&self) -> &DisplayList {
        &self.list
    }

    /// The figure as SVG with its lettering as outlines; one user unit is a millimetre.
    ///
    /// # Errors
    /// [`crate::error::ErrorKind::Invalid`] when the lettering has a character without a glyph.
    pub fn to_svg(&self) -> Result<String> {
        self.to_svg_with(TextAs::Paths)
    }

    /// The figure as SVG.
    ///
    /// # Errors
    /// [`crate::error::ErrorKind::Invalid`] when the lettering has a character without a glyph.
    pub fn to_svg_with(&self, text_as: TextAs) -> Result<String> {
        paint::svg::paint(&self.list, text_as)
    }

    /// The figure as a PDF of one page, its lettering as text in an embedded font.
    ///
    /// # Errors
    /// [`crate::error::ErrorKind::Invalid`] when the lettering has a character without a glyph.
    pub fn to_pdf(&self) -> Result<Vec<u8>> {
        self.to_pdf_with(TextAs::Text)
    }

    /// The figure as a PDF of one page.
    ///
    /// # Errors
    /// [`crate::error::ErrorKind::Invalid`] when the lettering has a character without a glyph.
    pub fn to_pdf_with(&self, text_as: TextAs) -> Result<Vec<u8>> {
        paint::pdf::paint(&self.list, text_as)
    }

    /// The figure as an 8-bit PNG with this many pixels a millimetre.
    ///
    /// # Errors
    /// [`crate::error::ErrorKind::TooLarge`] when the page would have less than one or more than 64 million pixels.
    pub fn to_png(&self, pixels_per_mm: f64) -> Result<Vec<u8>> {
        paint::pixels::png(&self.list, pixels_per_mm)
    }

    /// Width, height and straight 8-bit RGBA pixels, row by row, with this many pixels a millimetre.
    ///
    /// # Errors
    /// As [`Self::to_png`].
    pub fn to_pixels(&self, pixels_per_mm: f64) -> Result<(u32, u32, Vec<u8>)> {
        paint::pixels::paint(&self.list, pixels_per_mm)
    }
}

/// The parts that lie wholly off every panel in which they would stand, and why; where a figure has several cameras, with what tells
/// whose they are.
fn beyond(items: &[Item]) -> Vec<(&'static str, &'static str, String)> {
    let (mut off, mut on) = (Vec::new(), Vec::new());
    walk(items, &mut |group| match (group.part, group.off_page) {
        (Some(part), Some(why @ ("beyond" | "thin" | "needless" | "not-cut"))) => {
            off.push((part, why, camera_of(group)))
        }
        (Some(part), None) => on.push((part, camera_of(group))),
        _ => {}
    });
    // An arrow at the border says where it is.
    let points = on.iter().any(|(part, _)| *part == "arrow");
    let told = |part: &str| points && matches!(part, "focus-plane" | "hinge-line" | "scheimpflug-line");
    // What is on the page in one panel, and too thin there, is not off it.
    let thin: Vec<_> = off.iter().filter(|one| one.1 == "thin").cloned().collect();
    off.retain(|(part, why, whose)| {
        *why == "thin" || !thin.iter().any(|one| one.0 == *part && one.2 == *whose)
    });
    off.retain(|(part, _, whose)| !on.contains(&(*part, whose.clone())) && !told(part));
    off.sort_unstable();
    off.dedup();
    off
}

/// Which of a figure's cameras a part belongs to, in words that can follow its name.
fn camera_of(group: &Group) -> String {
    let words = group.data.iter().filter_map(|(name, value)| match *name {
        "data-tilt-deg" => Some(format!(" at a tilt of {value}°")),
        "data-extension-mm" => Some(format!(" at an extension of {value} mm")),
        "data-f-number" => Some(format!(" at f/{value}")),
        "data-circles" => Some(format!(" of {value} c")),
        _ => None,
    });
    words.collect()
}

/// Every group, the outer before those in it.
fn walk<'a>(items: &'a [Item], see: &mut impl FnMut(&'a Group)) {
    for item in items {
        if let Item::Group(group) = item {
            see(group);
            walk(&group.items, see);
        }
    }
}

fn finite(item: &Item) -> bool {
    let point = |p: &Point| p[0].abs() < 1e6 && p[1].abs() < 1e6;
    match item {
        Item::Group(group) => group.items.iter().all(finite),
        Item::Text(text) => point(&text.at) && point(&text.along),
        Item::Raster(raster) => raster.bounds.iter().all(|x| x.abs() < 1e6),
        Item::Shape(shape) => match &shape.geometry {
            Geometry::Line(a, b) => point(a) && point(b),
            Geometry::Circle { center, radius } => point(center) && radius.is_finite(),
            Geometry::Path(segments) => segments.iter().all(|s| match s {
                Segment::Move(p) | Segment::Line(p) => point(p),
                Segment::Quad(c, p) => point(c) && point(p),
                Segment::Cubic(c, d, p) => point(c) && point(d) && point(p),
                Segment::Close => true,
            }),
        },
    }
}
