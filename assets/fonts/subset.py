"""Makes the two small fonts of the diagrams from DejaVu Sans 2.37: a renamed subset without hints or layout tables.

    pip install fonttools
    python3 subset.py /usr/share/fonts/truetype/dejavu

DejaVu's licence asks that a changed font does not carry its name, hence "Groundglass Sans".
"""

import sys
from pathlib import Path

from fontTools.subset import Options, Subsetter
from fontTools.ttLib import TTFont

CHARACTERS = (
    "".join(chr(c) for c in range(0x20, 0x7F))
    + "".join(chr(c) for c in range(0xA0, 0x180) if c not in (0xAD, 0x149))  # Latin-1, Latin Extended-A
    + "ȘșȚțẞſ"
    + "".join(chr(c) for c in range(0x391, 0x3CA) if c != 0x3A2)  # Greek
    + "".join(chr(c) for c in range(0x400, 0x460))  # Cyrillic
    + "ϕϑ"
    + "′″₀₁₂₃₄₅₆₇₈₉⁰¹²³⁴⁵⁶⁷⁸⁹⁻"
    + "−∞≤≥≈≠∥⊥√∝…–—‘’‚“”„‹›•†‡‰€ƒ№™→←↑↓"
)


def make(source: Path, target: Path, style: str) -> None:
    font = TTFont(source, recalcTimestamp=False)
    options = Options()
    options.hinting = False
    options.layout_features = []
    options.glyph_names = False
    options.notdef_outline = True
    options.name_IDs = [0, 1, 2, 3, 4, 5, 6, 13, 14]
    options.drop_tables += ["GPOS", "GSUB", "GDEF", "kern", "FFTM", "gasp"]
    subsetter = Subsetter(options)
    subsetter.populate(unicodes=[ord(c) for c in CHARACTERS])
    subsetter.subset(font)
    family = "Groundglass Sans"
    names = {1: family, 2: style, 3: f"{family} {style}", 4: f"{family} {style}", 6: f"GroundglassSans-{style}"}
    for record in list(font["name"].names):
        if record.nameID in names:
            font["name"].setName(names[record.nameID], record.nameID, record.platformID, record.platEncID, record.langID)
    missing = [c for c in CHARACTERS if ord(c) not in font.getBestCmap()]
    if missing:
        print(f"{source.name} lacks {missing}", file=sys.stderr)
    font.save(target)


if __name__ == "__main__":
    here, fonts = Path(__file__).parent, Path(sys.argv[1])
    make(fonts / "DejaVuSans.ttf", here / "GroundglassSans-Regular.ttf", "Regular")
    make(fonts / "DejaVuSans-Oblique.ttf", here / "GroundglassSans-Oblique.ttf", "Oblique")
