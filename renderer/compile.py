"""From a scene to a plan. Nothing else decides what runs.

What a scene does not call for is not built: no light without colour, no texture that no shape shows, no
highlight of strength 0. What is built carries the lines of the scene that asked for it.
"""

from dataclasses import dataclass, field

import numpy as np

from renderer import cost, tiling
from renderer.accelerators.meeting import TreeMeeting
from renderer.accelerators.trees import FEW, tree_of
from renderer.arrays import Integers, Masks, column, magnitude
from renderer.assets import AssetError
from renderer.cameras import pinhole
from renderer.cameras.pinhole import Pinhole
from renderer.cost import COSTS
from renderer.effects import LIGHTS, SHAPES, TEXTURES, BuildFamily
from renderer.errors import SceneError
from renderer.lights import surfaces as light_surfaces
from renderer.lights.emitters import Emitter
from renderer.materials import phong
from renderer.materials.maps import ColorTexture, NormalMap
from renderer.materials.phong import SHARP, Ambient, Colors, Diffuse, Highlight, Phong
from renderer.plan import RenderPlan
from renderer.pointers import escaped
from renderer.scenes import LoadedScene, Source, load_scene
from renderer.shapes import Family
from renderer.shapes.ellipsoids import Ellipsoids
from renderer.shapes.family import Location, Meeting, Outline
from renderer.shapes.rectangles import Rectangles
from renderer.shapes.triangles import Triangles
from renderer.stages import Lighting, LightStage, Listing, PointStage, RayStage
from renderer.textures import Texture
from renderer.visibility.ellipsoids import EllipsoidShadows
from renderer.visibility.polygon_grids import GridPolygonShadows
from renderer.visibility.polygon_scatter import ScatterPolygonShadows
from renderer.visibility.trees import TreeShadows
from schemas.geometry import no_area
from schemas.plans import LeftOut
from schemas.problems import Problem
from schemas.quality import Quality
from schemas.sampling import Sampling
from schemas.scene import Scene
from schemas.shapes import Triangle


def compile_scene(
    scene: Source | LoadedScene, quality: Quality | None = None, *, culling: bool = True
) -> RenderPlan:
    """Decide what a scene calls for, and build just that.

    Parameters
    ----------
    scene
        What `load_scene` takes or gives.
    quality
        Takes the place of the scene's own sampling.
    culling
        Whether conservative tests may leave out work. Images are the same without, and slower.

    Returns
    -------
    RenderPlan

    Raises
    ------
    SceneError
        If the scene, or a file that it names, cannot be used.
    """
    return _Compiler(load_scene(scene), quality, culling).plan()


def compile_visibility(plan: RenderPlan) -> tuple[Lighting, ...]:
    """One stage a light of the scene, black ones too, that marks what blocks it and adds nothing."""
    return _Compiler(plan.scene, plan.quality, plan.culling).visibility()


@dataclass(slots=True)
class _Compiler:
    scene: LoadedScene
    quality: Quality | None
    culling: bool
    listing: Listing = field(default_factory=Listing)

    document: Scene = field(init=False)
    sampling: Sampling = field(init=False)
    dtype: np.dtype[np.floating] = field(init=False)
    names: list[str] = field(init=False)
    rays: float = field(init=False)
    degenerate: int = 0

    def __post_init__(self) -> None:
        self.document = self.scene.document
        self.sampling = _sampling(self.document.sampling, self.quality)
        double = self.quality is not None and self.quality.precision == "double"
        self.dtype = np.dtype(np.float64 if double else np.float32)
        shown = {shape.material for shape in self.document.shapes}
        self.names = [name for name in self.document.materials if name in shown]
        camera = self.document.camera
        self.rays = float(camera.width * camera.height * self.sampling.antialiasing.samples)

    def plan(self) -> RenderPlan:
        """Build the stages in the order in which they run."""
        camera = self._camera()
        families = self._families()
        emitters = self._emitters()
        meetings = [self._meeting(family, camera) for family in families]
        visible = self._visible_lights()
        table = phong.build([self.document.materials[name] for name in self.names])
        points, bent = self._surfaces(families, table)
        antialiasing = self.sampling.antialiasing
        return RenderPlan(
            scene=self.scene,
            quality=self.quality,
            camera=camera,
            antialiasing=antialiasing,
            seed=self.sampling.seed,
            passes=tiling.passes(camera.width, camera.height, antialiasing.samples),
            meetings=tuple(meetings),
            visible_lights=tuple(visible),
            surfaces=tuple(points),
            lightings=tuple(self._lighting(emitter, families, table) for emitter in emitters),
            unshaded=light_surfaces.Unshaded(
                column(self.document.background),
                light_surfaces.colors([light.color for light in self.document.lights]),
            ),
            materials=self._material_numbers(),
            bent=bent,
            dtype=self.dtype,
            culling=self.culling,
            degenerate=self.degenerate + sum(_without_area(family) for family in families),
            entries=tuple(self.listing.entries),
            left_out=(*self.listing.left_out, *self._unused()),
        )

    def visibility(self) -> tuple[Lighting, ...]:
        """Every light with what casts its shadows."""
        families = self._families()
        emitters = [self._emitter(number) for number in range(len(self.document.lights))]
        return tuple(
            Lighting(emitter, tuple(self._shadow_stages(emitter, families)), (), self.dtype)
            for emitter in emitters
        )

    def _emitter(self, number: int) -> Emitter:
        light = self.document.lights[number]
        return LIGHTS[type(light)](number, light, self.sampling.light, self.sampling.seed)

    def _camera(self) -> Pinhole:
        samples = self.sampling.antialiasing
        detail = f"rays through {samples.samples} {samples.pattern} places in each pixel"
        self.listing.add("camera rays", "camera", detail, ("/camera",), cost.seconds(self.rays, COSTS.camera))
        return pinhole.build(self.document.camera)

    def _material_numbers(self) -> Integers:
        numbers = {name: i for i, name in enumerate(self.names)}
        return np.array([numbers[shape.material] for shape in self.document.shapes], dtype=np.int64)

    def _families(self) -> list[Family]:
        """Shapes sorted into families, in the order in which kinds first appear.

        Triangles without area are dropped.
        """
        members: dict[BuildFamily, list[int]] = {}
        for number, shape in enumerate(self.document.shapes):
            if isinstance(shape, Triangle) and no_area(shape):
                pointer = (f"/shapes/{number}",)
                self.degenerate += 1
                self.listing.leave_out("shapes.triangle", "its three vertices lie on one line", pointer)
                continue
            members.setdefault(SHAPES[type(shape)], []).append(number)
        families = []
        for build, numbers in members.items():
            family = self._family(build, numbers)
            self._list_family(family)
            families.append(family)
        return families

    def _family(self, build: BuildFamily, numbers: list[int]) -> Family:
        try:
            return build(numbers, [self.document.shapes[number] for number in numbers], self.scene.assets)
        except AssetError as error:
            raise SceneError((Problem(pointer=error.pointer, detail=str(error), code="asset"),)) from error

    def _meeting(self, family: Family, camera: Pinhole) -> RayStage:
        """Few shapes are met one by one, many triangles through a tree."""
        if isinstance(family, Triangles) and family.numbers.size > FEW:
            return TreeMeeting(family, tree_of(family))
        return Meeting(family, Outline.of(family.corners(), camera) if self.culling else None)

    def _list_family(self, family: Family) -> None:
        pointers = tuple(f"/shapes/{number}" for number in np.unique(family.numbers).tolist())
        price = cost.seconds(self.rays, COSTS.shape * cost.met(len(pointers)))
        self.listing.add(
            f"hits of {family.kind}s", f"shapes.{family.kind}", "nearest hits of rays", pointers, price
        )

    def _emitters(self) -> list[Emitter]:
        """Lights that can add something."""
        emitters = []
        answering = [
            m for m in map(self.document.materials.get, self.names) if m and (m.diffuse or m.specular)
        ]
        for number, light in enumerate(self.document.lights):
            pointer, effect = (f"/lights/{number}",), f"lights.{light.type}"
            if not any(light.color):
                self.listing.leave_out(effect, f"/lights/{number} is black", pointer)
            elif not answering:
                self.listing.leave_out(effect, "no material that is shown answers light", pointer)
            else:
                emitters.append(self._emitter(number))
        return emitters

    def _visible_lights(self) -> list[light_surfaces.LightSurfaces]:
        """Rectangles that the camera sees, black ones too: they hide what is behind them."""
        numbers = [i for i, light in enumerate(self.document.lights) if getattr(light, "visible", False)]
        if not numbers:
            return []
        seen = [self._emitter(i) for i in numbers]
        pointers = tuple(f"/lights/{i}" for i in numbers)
        price = cost.seconds(self.rays, COSTS.shape * len(numbers))
        self.listing.add(
            "visible lights",
            "lights.rectangle",
            "rays that meet a light see its flat colour",
            pointers,
            price,
        )
        return [light_surfaces.build(seen)]

    def _surfaces(self, families: list[Family], table: Phong) -> tuple[list[PointStage], bool]:
        """Stages that form the points: geometry, colours, normals, ambient light."""
        if not families:
            return [], False
        maps = self._textures_of("normal_map")
        stages: list[PointStage] = [self._location(family, framed=bool(maps)) for family in families]
        pointers = tuple(f"/materials/{escaped(name)}" for name in self.names)
        self.listing.add(
            "materials", "materials.phong", "each point takes its material's parameters", pointers
        )
        stages.append(Colors(table))
        for name, used in self._textures_of("color_texture").items():
            stages.append(ColorTexture(self._texture(name, "color_texture", used), used))
        for name, used in maps.items():
            stages.append(NormalMap(self._texture(name, "normal_map", used), used))
        stages.extend(self._ambient(table))
        smooth = any(isinstance(family, Triangles) and bool(family.smooth.any()) for family in families)
        return stages, bool(maps) or smooth

    def _location(self, family: Family, *, framed: bool) -> Location:
        local = np.full(len(self.document.shapes), -1, dtype=np.int64)
        shapes, first = np.unique(family.numbers, return_index=True)
        local[shapes] = first
        pointers = tuple(f"/shapes/{number}" for number in shapes.tolist())
        detail = "positions, normals and texture coordinates of hits" + (", and tangents" if framed else "")
        share = family.numbers.size / max(1, len(self.document.shapes))
        price = cost.seconds(self.rays * share, COSTS.point)
        self.listing.add(f"points on {family.kind}s", f"shapes.{family.kind}", detail, pointers, price)
        return Location(family, local, framed)

    def _textures_of(self, part: str) -> dict[str, Masks]:
        """Which materials, (materials,) bool, use each texture in one of their parts."""
        used: dict[str, Masks] = {}
        for i, name in enumerate(self.names):
            texture = getattr(self.document.materials[name], part)
            if texture is not None:
                used.setdefault(texture, np.zeros(len(self.names), dtype=bool))[i] = True
        return used

    def _texture(self, name: str, part: str, used: Masks) -> Texture:
        texture = self.document.textures[name]
        asking = tuple(f"/materials/{escaped(self.names[i])}/{part}" for i in np.flatnonzero(used))
        detail = "colours by texture coordinates" if part == "color_texture" else "bends shading normals"
        price = cost.seconds(self.rays / len(self.names), COSTS.lookup * len(asking))
        effect = f"textures.{texture.type}" if part == "color_texture" else "materials.phong.normal_map"
        self.listing.add(
            f"{part.replace('_', ' ')} {name}", effect, detail, (f"/textures/{escaped(name)}", *asking), price
        )
        if part == "normal_map":
            # Directions, not colours: the file is read as it is stored.
            texture = texture.model_copy(update={"encoding": "linear"})
        try:
            return TEXTURES[type(texture)](texture, self.scene.assets)
        except AssetError as error:
            pointer = f"/textures/{escaped(name)}/asset"
            raise SceneError((Problem(pointer=pointer, detail=str(error), code="asset"),)) from error

    def _ambient(self, table: Phong) -> list[Ambient]:
        asking = tuple(
            f"/materials/{escaped(name)}"
            for name, share in zip(self.names, table.ambient, strict=True)
            if share
        )
        if not any(self.document.ambient):
            self.listing.leave_out("ambient", "/ambient is black", ("/ambient",))
        elif not asking:
            self.listing.leave_out(
                "ambient", "no material that is shown answers ambient light", ("/ambient",)
            )
        else:
            self.listing.add("ambient term", "ambient", "light from everywhere", ("/ambient", *asking))
            return [Ambient(table, column(self.document.ambient))]
        return []

    def _lighting(self, emitter: Emitter, families: list[Family], table: Phong) -> Lighting:
        pointer = f"/lights/{emitter.number}"
        effect = f"lights.{self.document.lights[emitter.number].type}"
        detail = f"{emitter.count} {emitter.pattern} points" if emitter.count > 1 else "one point"
        self.listing.add(
            f"points of light {emitter.number}",
            effect,
            detail,
            (pointer,),
            cost.seconds(self.rays, COSTS.faced),
        )
        shadows = self._shadows(emitter, families)
        return Lighting(emitter, tuple(shadows), tuple(self._terms(emitter, table, pointer)), self.dtype)

    def _shadows(self, emitter: Emitter, families: list[Family]) -> list[LightStage]:
        """A light asks for shadow rays against every family, unless there is but one shape."""
        pointer = f"/lights/{emitter.number}"
        if self._shades_nothing(families):
            self.listing.leave_out(
                "shadow rays", "a single convex shape has nothing to cast its shadow on", (pointer,)
            )
            return []
        stages = self._shadow_stages(emitter, families)
        for family in families:
            price = cost.seconds(self.rays * emitter.count, COSTS.shadow * min(2.0, family.numbers.size / 4))
            detail = f"shadow rays from points to light {emitter.number}"
            self.listing.add(f"shadows of {family.kind}s", f"shapes.{family.kind}", detail, (pointer,), price)
        return stages

    def _shades_nothing(self, families: list[Family]) -> bool:
        """A single shape shades nothing, but for an ellipsoid seen from inside: it hides what is outside."""
        if sum(family.numbers.size for family in families) > 1:
            return False
        position = column(self.document.camera.position)
        return not any(isinstance(family, Ellipsoids) and family.holds(position) for family in families)

    def _shadow_stages(self, emitter: Emitter, families: list[Family]) -> list[LightStage]:
        stages: list[LightStage] = []
        for family in families:
            match family:
                case Triangles() if family.numbers.size > FEW:
                    stages.append(TreeShadows(family, tree_of(family), emitter, self.dtype))
                case Rectangles() | Triangles():
                    kind = GridPolygonShadows if emitter.shared else ScatterPolygonShadows
                    stages.append(kind(family.occluders(), emitter, self.dtype, self.culling))
                case Ellipsoids():
                    stages.append(EllipsoidShadows(family, emitter, self.dtype, self.culling))
        return stages

    def _terms(self, emitter: Emitter, table: Phong, pointer: str) -> list[LightStage]:
        terms: list[LightStage] = []
        pairs = self.rays * emitter.count
        matt = tuple(f"/materials/{escaped(n)}" for n, s in zip(self.names, table.diffuse, strict=True) if s)
        if matt:
            terms.append(Diffuse(table))
            price = cost.seconds(pairs, COSTS.diffuse)
            self.listing.add(
                "diffuse term", "materials.phong", "cosines at light points", (pointer, *matt), price
            )
        double = np.dtype(np.float64)
        for above, upto, dtype in ((-1.0, SHARP, self.dtype), (SHARP, np.inf, double)):
            shiny = (table.specular > 0) & (table.shininess > above) & (table.shininess <= upto)
            asking = tuple(f"/materials/{escaped(self.names[i])}" for i in np.flatnonzero(shiny))
            if asking:
                terms.append(Highlight(table, above, upto, dtype))
                price = cost.seconds(pairs * len(asking) / len(self.names), COSTS.highlight)
                self.listing.add(
                    "highlights", "materials.phong", f"cosines to powers, {dtype}", (pointer, *asking), price
                )
        return terms

    def _unused(self) -> list[LeftOut]:
        """Materials and textures that no shape shows."""
        listing = Listing()
        for name in self.document.materials:
            if name not in self.names:
                listing.leave_out(
                    "materials.phong", "no shape has this material", (f"/materials/{escaped(name)}",)
                )
        parts = {*self._textures_of("color_texture"), *self._textures_of("normal_map")}
        for name, texture in self.document.textures.items():
            if name not in parts:
                reason = "no material that is shown uses this texture"
                listing.leave_out(f"textures.{texture.type}", reason, (f"/textures/{escaped(name)}",))
        return listing.left_out


def _sampling(sampling: Sampling, quality: Quality | None) -> Sampling:
    if quality is None:
        return sampling
    changes = {"antialiasing": quality.antialiasing, "light": quality.light}
    return sampling.model_copy(update={part: value for part, value in changes.items() if value is not None})


def _without_area(family: Family) -> int:
    """Triangles of a mesh that nothing can meet."""
    return int(np.count_nonzero(magnitude(family.normals) == 0)) if isinstance(family, Triangles) else 0
