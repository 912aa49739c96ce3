//! One panel while it is drawn. In: shapes with what they mean, labels with what they name. Out: the panel's group.

use super::display_list::{Color, Fill, Group, Item, PanelFrame, Point, Shape, Stroke, Text};
use super::lettering;
use super::panel::Panel;
use super::place::{self, Obstacle, Request, Weight};
use super::room::Room;
use super::sheet;
use super::theme::{self, Theme};
use crate::error::Result;

/// Distance of base lines in ems.
const LINE: f64 = 1.25;

/// A label and what it says: lines are parted by `\n`, variables stand between asterisks, and at `|` the line is
/// broken where that gives a better place.
pub(crate) struct Label {
    pub(crate) words: String,
    pub(crate) color: Color,
    pub(crate) anchors: Vec<Point>,
    pub(crate) toward: Point,
    pub(crate) area: Option<Vec<Point>>,
    /// The trace that it names, and where along it it stands best.
    pub(crate) line: Option<(Point, Point, f64)>,
    /// Left out where every place costs more; see [`place`].
    pub(crate) worth: f64,
}

impl Label {
    pub(crate) fn new(words: impl Into<String>, color: Color, anchors: Vec<Point>) -> Self {
        Self {
            words: words.into(),
            color,
            anchors,
            toward: [0.0; 2],
            area: None,
            line: None,
            worth: f64::INFINITY,
        }
    }

    pub(crate) fn toward(self, toward: Point) -> Self {
        Self { toward, ..self }
    }

    pub(crate) fn optional(self) -> Self {
        Self { worth: place::OPTIONAL, ..self }
    }

    pub(crate) fn adjacent(self) -> Self {
        Self { worth: place::ADJACENT, ..self }
    }

    /// Words along the trace of a plane, best at a share of the way from `a` to `b`; elsewhere only where it has no room.
    pub(crate) fn beside(self, (a, b): (Point, Point), share: f64) -> Self {
        Self { line: Some((a, b, share)), ..self }
    }

    pub(crate) fn within(self, area: Vec<Point>) -> Self {
        Self { area: Some(area), ..self }
    }

    fn variants(&self) -> Vec<String> {
        let mut variants = vec![self.words.replace('|', " ")];
        if self.words.contains('|') {
            variants.push(self.words.replace('|', "\n"));
        }
        variants
    }
}

/// A panel being drawn: groups in painting order, what labels keep clear of, and the labels.
pub(crate) struct Canvas<'a> {
    pub(crate) panel: Panel,
    pub(crate) theme: &'a Theme,
    /// Where arrows at the border point.
    pub(crate) arrows: Vec<Point>,
    /// What every part drawn next says of itself, besides its name.
    pub(crate) data: Vec<(&'static str, String)>,
    items: Vec<Item>,
    obstacles: Vec<Obstacle>,
    labels: Vec<Label>,
}

impl<'a> Canvas<'a> {
    pub(crate) fn new(panel: Panel, theme: &'a Theme) -> Self {
        Self {
            panel,
            theme,
            arrows: Vec::new(),
            data: Vec::new(),
            items: Vec::new(),
            obstacles: Vec::new(),
            labels: Vec::new(),
        }
    }

    /// Adds a group on top of what is there.
    pub(crate) fn group(&mut self, mut group: Group) {
        group.data.extend(self.data.iter().cloned());
        self.items.push(Item::Group(group));
    }

    /// Adds a part made of shapes.
    pub(crate) fn part(&mut self, name: &'static str, shapes: Vec<Shape>) {
        self.group(Group::of(name, shapes.into_iter().map(Item::Shape).collect()));
    }

    /// Labels keep clear of this line.
    pub(crate) fn avoid(&mut self, a: Point, b: Point, width: f64, weight: Weight) {
        self.obstacles.push(Obstacle { a, b, half: 0.5 * width, weight });
    }

    /// Labels keep clear of this disk.
    pub(crate) fn avoid_disk(&mut self, center: Point, radius: f64) {
        self.obstacles.push(Obstacle { a: center, b: center, half: radius, weight: Weight::Heavy });
    }

    pub(crate) fn label(&mut self, label: Label) {
        self.labels.push(label);
    }

    /// Forgets the labels.
    pub(crate) fn without_labels(&mut self) {
        self.labels.clear();
    }

    /// Places the labels and closes the panel.
    ///
    /// # Errors
    /// When a label has a character without a glyph.
    pub(crate) fn finish(mut self, frame: PanelFrame) -> Result<Group> {
        // What is named in a point has the least freedom.
        self.labels.sort_by_key(|label| label.line.is_some());
        let mut requests = Vec::new();
        for label in &self.labels {
            let sizes = label.variants().iter().map(|words| size(words)).collect::<Result<Vec<_>>>()?;
            requests.push(Request {
                sizes,
                anchors: label.anchors.clone(),
                toward: label.toward,
                area: label.area.clone(),
                line: label.line,
                worth: label.worth,
            });
        }
        self.data.clear();
        let placed = place::place(&self.panel, &self.obstacles, &requests);
        let mut leaders = Vec::new();
        let mut groups = Vec::new();
        for (label, place) in self.labels.iter().zip(placed) {
            let Some(place) = place else {
                if label.worth.is_infinite() {
                    groups.push(Item::Group(without_room(&label.words)));
                }
                continue;
            };
            if let Some((a, b)) = place.leader {
                leaders.push(Shape::line(a, b, theme::solid(label.color, theme::HAIR)));
            }
            let mut items = Vec::new();
            if place.plate {
                items.push(Item::Shape(plate(&place.room, self.theme.paper)));
            }
            items.extend(
                lines(&label.variants().swap_remove(place.variant), &place.room, label.color)?
                    .into_iter()
                    .map(Item::Text),
            );
            groups.push(Item::Group(Group::of("label", items)));
        }
        if !leaders.is_empty() {
            self.part("leader", leaders);
        }
        self.items.extend(groups);
        let edge = Shape::polyline(
            &self.panel.corners(),
            true,
            None,
            Some(Stroke { width: theme::THIN, ..theme::solid(self.theme.faint, theme::THIN) }),
        );
        self.part("frame", vec![edge]);
        Ok(Group { panel: Some(frame), items: self.items, ..Group::default() })
    }
}

/// The empty group of words for which a panel has no room.
pub(crate) fn without_room(words: &str) -> Group {
    let plain = sheet::plain(&words.replace(['|', '\n'], " "));
    Group { data: vec![("data-words", plain)], ..Group::off_page("label", "no-room") }
}

/// Width and height of the box that some lines of text take.
pub(crate) fn size(words: &str) -> Result<[f64; 2]> {
    let mut width: f64 = 0.0;
    let mut count = 0.0;
    for line in words.split('\n') {
        width = width.max(lettering::width(&lettering::runs(line))? * theme::LETTER);
        count += 1.0;
    }
    let em = lettering::ASCENT + lettering::DESCENT + (count - 1.0) * LINE;
    Ok([width, em * theme::LETTER])
}

/// The lines of words that fill a room.
///
/// # Errors
/// When a glyph is missing.
pub(crate) fn lines(words: &str, room: &Room, color: Color) -> Result<Vec<Text>> {
    let mut texts = Vec::new();
    let mut base = lettering::ASCENT * theme::LETTER - room.half[1];
    for line in words.split('\n') {
        let text = lettering::text(line, room.page([-room.half[0], base]), theme::LETTER, color)?;
        texts.push(Text { along: room.along, ..text });
        base += LINE * theme::LETTER;
    }
    Ok(texts)
}

/// Paper behind a label that thin lines run under.
fn plate(room: &Room, paper: Color) -> Shape {
    Shape::polyline(&room.corners(0.3), true, Some(Fill::Flat { color: paper, opacity: 0.8 }), None)
}
