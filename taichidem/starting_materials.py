"""Starting materials for a study, each number with its source; what nobody was found to have measured is left out.

They are where a calibration begins, not what one's own granules are: moisture, surface and shape change all of them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from taichidem.errors import unknown_name

SUDSAWAT = "Sudsawat, Chongchitpaisan & Arunyanart (2023), doi 10.21303/2461-4262.2023.002968"
CHUNG_OOI = "Chung & Ooi (2011), doi 10.1007/s10035-011-0277-0"
BOAC = "Boac, Casada, Maghirang & Harner (2010), Trans. ASABE 53, hdl.handle.net/2097/18889"
KIBAR = "Kibar (2008), Int. Agrophysics 22, 239-244 (8 to 16 % moisture; friction on galvanised steel)"
SEZER = "Sezer, Balkaya, Karaagac & Oner (2011), Afr. J. Biotechnol., ajol.info/index.php/ajb/article/view/93308"
MAIZE = (
    "Contact parameter calibration of the maize kernel polyhedral discrete element model, Agriculture (Sep 2024), "
    "doaj.org/article/60ec5dd5f18a46b5848b620b933fdfde"
)
DCS = "DCS Computing, material models of coarse and fine sand, dcscomputing.freshdesk.com/support/solutions/articles/201000124214"
MATMAKE = (
    "matmake.com/materials-data/polymethyl-methacrylate-properties.html, after Cardarelli (2018), Materials Handbook"
)


@dataclass(frozen=True)
class Sourced:
    """A published number, in SI.

    Attributes:
        value: to start from.
        source: who measured or collected it.
        low, high: range that was published, or None where there is a single value.
    """

    value: float
    source: str
    low: float | None = None
    high: float | None = None


@dataclass(frozen=True)
class StartingContact:
    """Restitution and static friction of a pair of materials [1]; None where no source was found."""

    restitution: Sourced | None = None
    static_friction: Sourced | None = None


@dataclass(frozen=True)
class StartingMaterial:
    """A material to begin with.

    Attributes:
        name: as it is called in a study.
        title: for people.
        density: [kg/m³].
        youngs_modulus: of the solid [Pa], not softened.
        poissons_ratio: [1].
        contacts: with other materials, and with itself, by their names.
        aliases: other names by which people may ask for it.
        note: what else to know.
    """

    name: str
    title: str
    density: Sourced
    youngs_modulus: Sourced | None = None
    poissons_ratio: Sourced | None = None
    contacts: Mapping[str, StartingContact] = field(default_factory=dict)
    aliases: tuple[str, ...] = ()
    note: str = ""


POLYPROPYLENE = StartingMaterial(
    "polypropylene",
    "Polypropylene granules",
    density=Sourced(910.0, SUDSAWAT, 889.0, 1107.0),
    youngs_modulus=Sourced(1.3e9, SUDSAWAT, 1.3e9, 2e9),
    poissons_ratio=Sourced(0.36, SUDSAWAT, 0.36, 0.41),
    contacts={
        "polypropylene": StartingContact(Sourced(0.55, SUDSAWAT, 0.3, 0.97), Sourced(0.52, SUDSAWAT, 0.1, 0.6)),
        "steel": StartingContact(Sourced(0.55, SUDSAWAT, 0.55, 0.71), Sourced(0.26, SUDSAWAT, 0.26, 0.3)),
    },
    aliases=("pp",),
)
GLASS = StartingMaterial(
    "glass",
    "Glass beads",
    density=Sourced(2800.0, CHUNG_OOI),
    youngs_modulus=Sourced(4.8e10, CHUNG_OOI),
    poissons_ratio=Sourced(0.2, CHUNG_OOI),
    contacts={"glass": StartingContact(static_friction=Sourced(0.35, CHUNG_OOI))},
    aliases=("glass_beads",),
    note="The numbers are those of a benchmark of contact laws; soda-lime glass is lighter, weigh your beads.",
)
STEEL = StartingMaterial(
    "steel",
    "Steel",
    density=Sourced(7800.0, SUDSAWAT),
    youngs_modulus=Sourced(1.98e11, SUDSAWAT),
    poissons_ratio=Sourced(0.3, SUDSAWAT),
)
ACRYLIC = StartingMaterial(
    "acrylic",
    "Acrylic glass (PMMA)",
    density=Sourced(1185.0, MATMAKE, 1180.0, 1190.0),
    youngs_modulus=Sourced(3.036e9, MATMAKE),
    aliases=("pmma", "plexiglass"),
)
SOYBEAN = StartingMaterial(
    "soybean",
    "Soybeans",
    density=Sourced(983.0, KIBAR, 906.0, 983.0),
    contacts={
        "soybean": StartingContact(Sourced(0.6, BOAC), Sourced(0.45, BOAC)),
        "steel": StartingContact(static_friction=Sourced(0.23, KIBAR, 0.164, 0.286)),
    },
    aliases=("soy", "soybeans"),
    note="As single spheres with a shear modulus of 1.04 MPa, soybeans had a friction of 0.30 on steel (Boac et al.).",
)
MAIZE_KERNELS = StartingMaterial(
    "maize",
    "Maize kernels",
    density=Sourced(1410.0, SEZER, 1367.0, 1455.0),
    contacts={
        "maize": StartingContact(Sourced(0.318, MAIZE), Sourced(0.182, MAIZE)),
        "steel": StartingContact(Sourced(0.5, MAIZE), Sourced(0.545, MAIZE)),
    },
    aliases=("corn",),
    note="The contact numbers belong to kernels modelled as polyhedra; spheres will need more friction or rolling resistance.",
)
QUARTZ_SAND = StartingMaterial(
    "quartz_sand",
    "Quartz sand",
    density=Sourced(2650.0, DCS),
    poissons_ratio=Sourced(0.3, DCS),
    contacts={"quartz_sand": StartingContact(Sourced(0.66, DCS, 0.648, 0.68), Sourced(0.82, DCS, 0.72, 0.918))},
    aliases=("sand",),
    note="The contact numbers were calibrated with spheres that resist rolling (0.05 to 0.057); consider a rolling effect.",
)
LIMESTONE = StartingMaterial(
    "limestone",
    "Limestone gravel",
    density=Sourced(2500.0, CHUNG_OOI),
    youngs_modulus=Sourced(2.0e10, CHUNG_OOI),
    poissons_ratio=Sourced(0.25, CHUNG_OOI),
    aliases=("gravel",),
)

STARTING_MATERIALS: Mapping[str, StartingMaterial] = {
    m.name: m for m in (POLYPROPYLENE, GLASS, STEEL, ACRYLIC, SOYBEAN, MAIZE_KERNELS, QUARTZ_SAND, LIMESTONE)
}


def starting_material(name: str) -> StartingMaterial:
    """Return a starting material by its name or another name of it, upper or lower case.

    Raises:
        InputError: there is none of that name.
    """
    wanted = name.strip().lower().replace(" ", "_").replace("-", "_")
    for material in STARTING_MATERIALS.values():
        if wanted == material.name or wanted in material.aliases:
            return material
    raise unknown_name("starting material", name, STARTING_MATERIALS)


def starting_contact(first: StartingMaterial, second: StartingMaterial) -> StartingContact:
    """Return what is known of a pair of materials, empty where nothing is."""
    return first.contacts.get(second.name) or second.contacts.get(first.name) or StartingContact()
