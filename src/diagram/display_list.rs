//! What a figure is when all decisions are taken: shapes, text and groups with meaning, in page millimetres.
//!
//! In: numbers from the figures. Out: to the painters, which hold no opinions. The page's origin is its top
//! left corner, x right, y down; items are painted in order. It is public to be read: figures are made by
//! [`SideView`](super::SideView) and [`FigureFile`](super::FigureFile), charts of numbers of your own by the latter's kind `plot`.

/// A point of the page in millimetres, x right, y down.
pub type Point = [f64; 2];

/// An sRGB colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Color {
    /// Red.
    pub r: u8,
    /// Green.
    pub g: u8,
    /// Blue.
    pub b: u8,
}

impl Color {
    /// The colour `0xRRGGBB`.
    pub const fn hex(rgb: u32) -> Self {
        Self { r: (rgb >> 16) as u8, g: (rgb >> 8) as u8, b: rgb as u8 }
    }
}

/// How an area is filled. Coverage is blended in sRGB, as SVG, PDF and pixel painters all do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fill {
    /// One colour.
    Flat {
        /// The colour.
        color: Color,
        /// 0 (nothing) to 1.
        opacity: f64,
    },
    /// One colour whose opacity changes linearly along the page from one point to another, and stays the
    /// same beyond them.
    Fade {
        /// The colour.
        color: Color,
        /// Where the fade begins.
        from: Point,
        /// Where it ends.
        to: Point,
        /// Opacity at and before `from`.
        from_opacity: f64,
        /// Opacity at and after `to`.
        to_opacity: f64,
    },
}

/// How a line is drawn: butt caps, mitre joins (limit 4).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stroke {
    /// The colour.
    pub color: Color,
    /// 0 (nothing) to 1.
    pub opacity: f64,
    /// Width in millimetres.
    pub width: f64,
    /// Lengths of dashes and gaps in turn, millimetres; empty for a solid line.
    pub dash: &'static [f64],
    /// Whether joins are round.
    pub round: bool,
}

/// One piece of an outline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Segment {
    /// Begins a sub-path.
    Move(Point),
    /// A straight line.
    Line(Point),
    /// A quadratic Bézier curve: control point, end.
    Quad(Point, Point),
    /// A cubic Bézier curve: control points, end.
    Cubic(Point, Point, Point),
    /// Closes the sub-path.
    Close,
}

/// The geometry of a shape.
#[derive(Clone, Debug, PartialEq)]
pub enum Geometry {
    /// A straight line.
    Line(Point, Point),
    /// An outline; filled by the non-zero rule.
    Path(Vec<Segment>),
    /// A circle.
    Circle {
        /// Its centre.
        center: Point,
        /// Its radius, millimetres.
        radius: f64,
    },
}

/// A shape with its paint; the fill goes under the stroke.
#[derive(Clone, Debug, PartialEq)]
pub struct Shape {
    /// Where.
    pub geometry: Geometry,
    /// Inside.
    pub fill: Option<Fill>,
    /// Along.
    pub stroke: Option<Stroke>,
}

impl Shape {
    /// A stroked line.
    pub fn line(from: Point, to: Point, stroke: Stroke) -> Self {
        Self { geometry: Geometry::Line(from, to), fill: None, stroke: Some(stroke) }
    }

    /// An open or closed chain of straight lines.
    pub fn polyline(points: &[Point], closed: bool, fill: Option<Fill>, stroke: Option<Stroke>) -> Self {
        let mut path: Vec<Segment> = points
            .iter()
            .enumerate()
            .map(|(i, &p)| if i == 0 { Segment::Move(p) } else { Segment::Line(p) })
            .collect();
        if closed && !path.is_empty() {
            path.push(Segment::Close);
        }
        Self { geometry: Geometry::Path(path), fill, stroke }
    }

    /// A circle.
    pub fn circle(center: Point, radius: f64, fill: Option<Fill>, stroke: Option<Stroke>) -> Self {
        Self { geometry: Geometry::Circle { center, radius }, fill, stroke }
    }
}

/// Which face of the diagrams' font.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Face {
    /// Words, numbers, units.
    Regular,
    /// Variables.
    Oblique,
}

/// How a stretch of text stands to the base line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Script {
    /// On it, full size.
    #[default]
    Normal,
    /// An index: smaller, below.
    Sub,
    /// An exponent: smaller, above.
    Super,
}

impl Script {
    /// Its size, in ems of the text.
    pub fn size(self) -> f64 {
        if self == Self::Normal { 1.0 } else { 0.68 }
    }

    /// How far its base line lies below that of the text, in ems of the text.
    pub fn drop(self) -> f64 {
        match self {
            Self::Normal => 0.0,
            Self::Sub => 0.16,
            Self::Super => -0.29,
        }
    }
}

/// A stretch of text in one face.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Run {
    /// The characters; every one has a glyph.
    pub text: String,
    /// The face.
    pub face: Face,
    /// Where it stands.
    pub script: Script,
}

impl Run {
    /// A run on the base line.
    pub fn new(text: impl Into<String>, face: Face) -> Self {
        Self { text: text.into(), face, script: Script::Normal }
    }
}

/// One line of text.
#[derive(Clone, Debug, PartialEq)]
pub struct Text {
    /// The left end of the base line.
    pub at: Point,
    /// The unit direction of the base line: `[1, 0]` for level text. Turned text is turned about `at`.
    pub along: Point,
    /// Size of the em in millimetres.
    pub size: f64,
    /// The colour.
    pub color: Color,
    /// What it says.
    pub runs: Vec<Run>,
    /// `[left, top, right, bottom]` of the room it takes before it is turned: advance widths, ascenders and descenders.
    pub bounds: [f64; 4],
}

impl Text {
    /// Whether it is not level.
    pub fn is_turned(&self) -> bool {
        self.along != [1.0, 0.0]
    }

    /// The corners of the room it takes on the page: above its first letter, above its last, below that, below the first.
    pub fn corners(&self) -> [Point; 4] {
        let [l, t, r, b] = self.bounds;
        [[l, t], [r, t], [r, b], [l, b]].map(|p| self.turned(p))
    }

    /// A point of the level text, turned with it.
    pub(crate) fn turned(&self, p: Point) -> Point {
        if !self.is_turned() {
            return p;
        }
        let ([c, s], [x, y]) = (self.along, [p[0] - self.at[0], p[1] - self.at[1]]);
        [self.at[0] + x * c - y * s, self.at[1] + x * s + y * c]
    }

    /// The characters of all runs.
    pub fn plain(&self) -> String {
        self.runs.iter().map(|run| run.text.as_str()).collect()
    }
}

/// What a panel shows, to say where each of its points lies in the world.
#[derive(Clone, Debug, PartialEq)]
pub struct PanelFrame {
    /// `main`, `inset`, ...
    pub name: &'static str,
    /// A point of the section plane, then unit vectors to the page's right and up; world, metres.
    pub section: [f64; 9],
    /// SVG matrix order, section metres to page millimetres.
    pub page_from_section: [f64; 6],
}

/// Items that belong together, with what they mean.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Group {
    /// What is drawn: `lens`, `focus-plane`, ... (the table is in [`crate::diagram`]).
    pub part: Option<&'static str>,
    /// Set when the group is a panel. Panels do not nest.
    pub panel: Option<PanelFrame>,
    /// The part lies wholly off its panel, and why: `beyond`, `at-infinity`, `parallel`, `not-cut`, `thin`, `needless`, `no-room`.
    pub off_page: Option<&'static str>,
    /// Numbers of what is drawn, each under a name that begins with `data-`.
    pub data: Vec<(&'static str, String)>,
    /// What is in it.
    pub items: Vec<Item>,
}

impl Group {
    /// An empty group for a part.
    pub fn part(name: &'static str) -> Self {
        Self { part: Some(name), ..Self::default() }
    }

    /// A group for a part with these items.
    pub fn of(name: &'static str, items: Vec<Item>) -> Self {
        Self { part: Some(name), items, ..Self::default() }
    }

    /// The empty group of a part that lies off the panel.
    pub fn off_page(name: &'static str, why: &'static str) -> Self {
        Self { part: Some(name), off_page: Some(why), ..Self::default() }
    }
}

/// A picture set in a figure.
#[derive(Clone, Debug, PartialEq)]
pub struct Raster {
    /// Left, top, right, bottom.
    pub bounds: [f64; 4],
    /// Pixels across and down.
    pub size: [u32; 2],
    /// Red, green, blue, row by row from the top.
    pub pixels: std::sync::Arc<[u8]>,
    /// The same as a JPEG file.
    pub jpeg: std::sync::Arc<[u8]>,
}

/// One thing to paint.
#[derive(Clone, Debug, PartialEq)]
pub enum Item {
    /// Several, in order.
    Group(Group),
    /// A shape.
    Shape(Shape),
    /// Text.
    Text(Text),
    /// A picture.
    Raster(Raster),
}

/// How an SVG may change its colours when it is shown; the other painters keep them.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Recoloring {
    /// Not at all.
    #[default]
    None,
    /// On dark pages each first colour becomes the second.
    Dark(Vec<(Color, Color)>),
    /// `ink` becomes the colour of the text around, and what is filled with `paper` is left unfilled.
    ToText {
        /// The colour of words.
        ink: Color,
        /// The colour of the page.
        paper: Color,
    },
}

/// A whole figure.
#[derive(Clone, Debug, PartialEq)]
pub struct DisplayList {
    /// Width and height of the page in millimetres.
    pub page: [f64; 2],
    /// What the page is painted with first; `None` leaves it transparent.
    pub background: Option<Color>,
    /// What an SVG may change of the colours.
    pub recoloring: Recoloring,
    /// The figure's name.
    pub title: String,
    /// The figure in words, with its numbers.
    pub description: String,
    /// What to paint, in order.
    pub items: Vec<Item>,
}
