"""The scene's document as types: dicts whose members an editor and a type checker know.

    from sunbox.document import DiffuseMaterial, PerspectiveCamera, Scene, SphereShape

    scene: Scene = {"version": 1, "camera": PerspectiveCamera(position=[0, 1, 4], target=[0, 1, 0]), ...}

Written by generate.py from the service's schema; a test holds it to that.
"""

from typing import Any, Literal, Required, TypedDict  # evaluated now: else a TypedDict does not see what is required


class ColorTexture(TypedDict, total=False):
    """A texture in place of a colour."""

    channel: Literal["r", "g", "b", "a"]
    """Read as a grey; without it, the colour."""
    factor: list[float] | float | str | dict[str, Any]
    """Multiplies the decoded texture; the product keeps to the parameter's range. (0 to 1e+20, default [1.0, 1.0,
    1.0])"""
    texture: Required[str]
    """The name of one of the scene's textures."""


class HeightTexture(TypedDict, total=False):
    """Heights above the surface, in metres along its normal: the scale times the texture minus the midlevel."""

    channel: Literal["r", "g", "b", "a"]
    """Which of the texture's channels is read. (default 'r')"""
    scale: float
    """How far white lies above black; below 0 white is deep. (m, default 0.02)"""
    midlevel: float
    """The value of the texture that lies where the surface is. (default 0.5)"""
    shading: bool
    """Off: only shapes with displacement show it, as where a normal map shows the same relief. (default True)"""
    texture: Required[str]
    """The name of one of the scene's textures."""


class NormalTexture(TypedDict, total=False):
    """A normal map: red along growing u, green along growing v, blue outwards."""

    scale: float
    """Multiplies red and green: 0 is flat, 1 as the map has it. (0 to 1e+20, default 1.0)"""
    texture: Required[str]
    """The name of one of the scene's textures."""


class ScalarTexture(TypedDict, total=False):
    """One channel of a texture in place of a number."""

    channel: Literal["r", "g", "b", "a"]
    """Which of the texture's channels is read. (default 'r')"""
    factor: float
    """Multiplies the texture; the product keeps to the parameter's range. (0 to 1e+20, default 1.0)"""
    texture: Required[str]
    """The name of one of the scene's textures."""


class BlinnPhongMaterial(TypedDict, total=False):
    """The classic highlight of early rasterisers, as a baseline: it conserves no energy."""

    type: Required[Literal["blinn_phong"]]
    diffuse: Required[list[float] | float | str | ColorTexture]
    """Share of light that is sent back equally in all directions. (0 to 1)"""
    specular: Required[list[float] | float | str | ColorTexture]
    """The colour of the highlight. A sharper highlight sends back less light. (0 to 1)"""
    shininess: Required[float | ScalarTexture]
    """How tight the highlight is: 10 is dull, 100 is polished, 1000 is close to a mirror. (0 to 1e+20)"""
    ambient: list[float] | float | str | dict[str, Any] | ColorTexture
    """Light that is added wherever the surface is seen; it does not light other things. (W/(m^2 sr), 0 to 1e+20,
    default [0.0, 0.0, 0.0])"""
    emission: list[float] | float | str | dict[str, Any] | ColorTexture
    """The light that leaves the front side. Above 0 the thing is a lamp. (W/(m^2 sr), 0 to 1e+20, default [0.0, 0.0,
    0.0])"""
    emission_sides: Literal["front", "both"]
    """Whether only the front shines, or the back as well. (default 'front')"""
    alpha: float | ScalarTexture
    """1 is solid, 0.5 a fine mesh, 0 is not there at all. (0 to 1, default 1.0)"""
    alpha_cutoff: float | ScalarTexture
    """Cuts the shape out sharply: an opacity of at least this is solid, anything below is not there. (0 to 1)"""
    normal_map: NormalTexture
    """Small bumps: an image that changes how the surface catches the light, but not its outline."""
    height: HeightTexture
    """Relief: it changes how the surface catches the light, and moves the surface of meshes with displacement."""


class MatrixTransform(TypedDict, total=False):
    """An affine, invertible matrix that takes the shape to the world."""

    matrix: Required[list[float]]
    """16 numbers, row by row; the last row is 0 0 0 1."""


class Medium(TypedDict, total=False):
    """A homogeneous medium, by its coefficients or by the colour and the mean free path that it shows."""

    absorption: list[float] | float | str | dict[str, Any]
    """The rate at which light is lost, per channel. (1/m, 0 to 1e+09, default [0.0, 0.0, 0.0])"""
    scattering: list[float] | float | str | dict[str, Any]
    """The rate at which light turns, per channel. (1/m, 0 to 1e+09, default [0.0, 0.0, 0.0])"""
    albedo: list[float] | float | str
    """The colour that much of it has. With a radius it replaces absorption and scattering. (0 to 1)"""
    radius: list[float] | float | str | dict[str, Any]
    """How far light goes, on average, before something happens to it, per channel. (m, 0 to 1e+09)"""
    g: float
    """Where light goes when it is scattered: above 0 onwards, below 0 back. (-1 to 1, default 0.0)"""
    emission: list[float] | float | str | dict[str, Any]
    """The light that it gives off itself, for each metre. (W/(m^3 sr), 0 to 1e+20, default [0.0, 0.0, 0.0])"""


class Transform(TypedDict, total=False):
    """T Rz Ry Rx S: scaled first, then turned about X, Y and Z, then moved."""

    translate: list[float]
    """Moves the thing along X, Y and Z. (m, default [0.0, 0.0, 0.0])"""
    rotate: list[float]
    """Turns the thing about X, then Y, then Z. (degrees, default [0.0, 0.0, 0.0])"""
    scale: float | list[float]
    """How large the thing is: one factor, or one for each axis. Negative factors mirror it. (default [1.0, 1.0,
    1.0])"""


class BoxShape(TypedDict, total=False):
    """A box along the axes; a transform turns it."""

    priority: int
    """Where glass, liquids and other clear bodies overlap, the one with the highest number is there. (-100 to 100,
    default 0)"""
    medium: Medium
    """What fills it, behind a surface that transmits."""
    type: Required[Literal["box"]]
    min: Required[list[float]]
    """The corner with the smallest x, y and z. (m)"""
    max: Required[list[float]]
    """The corner with the largest x, y and z. (m)"""
    name: str
    """For people: nothing refers to it. Slashes make groups, as in a path: Truck/Wheels/Left."""
    material: Required[str]
    """The name of one of the scene's materials."""
    transform: Transform | MatrixTransform
    """Where the thing stands, how it is turned and how large it is."""
    visible_to_camera: bool
    """Off: the camera looks through it, but its light, shadow and reflections stay. (default True)"""


class CheckerTexture(TypedDict, total=False):
    """Two colours by turns: the first where floor(u scale_u) + floor(v scale_v) is even."""

    type: Required[Literal["checker"]]
    a: Required[list[float] | float | str | dict[str, Any]]
    """Of the square at u = v = 0. (0 to 1e+20)"""
    b: Required[list[float] | float | str | dict[str, Any]]
    """Of its neighbours. (0 to 1e+20)"""
    scale: list[float]
    """How many squares along u and v. (default [8.0, 8.0])"""
    mapping: Literal["uv", "box", "sphere"]
    """By the shape's texture coordinates, or, without those: box, once a metre; sphere, once around the middle.
    (default 'uv')"""


class ConstantEnvironment(TypedDict, total=False):
    """The same radiance from every direction."""

    type: Required[Literal["constant"]]
    radiance: Required[list[float] | float | str | dict[str, Any]]
    """How bright it is in every direction, as under an overcast sky. (W/(m^2 sr), 0 to 1e+20)"""
    rotation: float
    """Turns the surroundings about the vertical, counter-clockwise seen from above. (degrees, default 0.0)"""
    scale: float
    """How bright the surroundings are. Twice as much is one stop. (0 to 1e+20, default 1.0)"""
    background: bool
    """Off: it lights the scene, but the picture is transparent where it would be seen. (default True)"""
    medium: Medium
    """What fills all space outside of bodies: fog, or the sea."""


class CubeFaces(TypedDict, total=False):
    """Six square images of one size, in OpenGL's layout, each named by the axis in its middle."""

    px: Required[str]
    """Image of what lies towards +X; right is -Z, up is +Y."""
    nx: Required[str]
    """Image of what lies towards -X; right is +Z, up is +Y."""
    py: Required[str]
    """Image of what lies above; right is +X, up is -Z."""
    ny: Required[str]
    """Image of what lies below; right is +X, up is +Z."""
    pz: Required[str]
    """Image of what lies towards +Z; right is +X, up is +Y."""
    nz: Required[str]
    """Image of what lies towards -Z; right is -X, up is +Y."""


class CubemapEnvironment(TypedDict, total=False):
    """Six HDR images, the faces of a cube."""

    blur: float
    """Blurs the surroundings: less noise and softer shadows, but less true to the image. (degrees, 0 to 90, default
    0.0)"""
    type: Required[Literal["cubemap"]]
    assets: Required[CubeFaces]
    """Six square HDR images of one size."""
    rotation: float
    """Turns the surroundings about the vertical, counter-clockwise seen from above. (degrees, default 0.0)"""
    scale: float
    """How bright the surroundings are. Twice as much is one stop. (0 to 1e+20, default 1.0)"""
    background: bool
    """Off: it lights the scene, but the picture is transparent where it would be seen. (default True)"""
    medium: Medium
    """What fills all space outside of bodies: fog, or the sea."""


class CylinderShape(TypedDict, total=False):
    """A cylinder between two flat caps, or an open tube."""

    priority: int
    """Where glass, liquids and other clear bodies overlap, the one with the highest number is there. (-100 to 100,
    default 0)"""
    medium: Medium
    """What fills it, behind a surface that transmits."""
    type: Required[Literal["cylinder"]]
    base: Required[list[float]]
    """The middle of the end where it begins. (m)"""
    axis: Required[list[float]]
    """From the base to the other end. (m)"""
    radius: Required[float]
    """From the middle to the side. (m, 0 to 1e+09)"""
    caps: bool
    """Off: both ends are open, and you can see its inside. (default True)"""
    name: str
    """For people: nothing refers to it. Slashes make groups, as in a path: Truck/Wheels/Left."""
    material: Required[str]
    """The name of one of the scene's materials."""
    transform: Transform | MatrixTransform
    """Where the thing stands, how it is turned and how large it is."""
    visible_to_camera: bool
    """Off: the camera looks through it, but its light, shadow and reflections stay. (default True)"""


class DiffuseMaterial(TypedDict, total=False):
    """Scatters equally in all directions: f = albedo / pi."""

    type: Required[Literal["diffuse"]]
    albedo: Required[list[float] | float | str | ColorTexture]
    """The colour, as the share of light that is sent back: snow 0.9, white paint 0.8, grass 0.25, charcoal 0.04. (0
    to 1)"""
    emission: list[float] | float | str | dict[str, Any] | ColorTexture
    """The light that leaves the front side. Above 0 the thing is a lamp. (W/(m^2 sr), 0 to 1e+20, default [0.0, 0.0,
    0.0])"""
    emission_sides: Literal["front", "both"]
    """Whether only the front shines, or the back as well. (default 'front')"""
    alpha: float | ScalarTexture
    """1 is solid, 0.5 a fine mesh, 0 is not there at all. (0 to 1, default 1.0)"""
    alpha_cutoff: float | ScalarTexture
    """Cuts the shape out sharply: an opacity of at least this is solid, anything below is not there. (0 to 1)"""
    normal_map: NormalTexture
    """Small bumps: an image that changes how the surface catches the light, but not its outline."""
    height: HeightTexture
    """Relief: it changes how the surface catches the light, and moves the surface of meshes with displacement."""


class DirectionalLight(TypedDict, total=False):
    """Light from infinity, such as the sun's: parallel, or from a disk in the sky where it has a diameter."""

    type: Required[Literal["directional"]]
    direction: Required[list[float]]
    """The direction in which the light travels."""
    irradiance: Required[list[float] | float | str | dict[str, Any]]
    """How bright the light is on a surface that faces it. The sun at noon gives about 1000. (W/m^2, 0 to 1e+20)"""
    angular_diameter: float
    """How large the light looks: 0 gives sharp shadows, 0.53 is the sun, more is softer. Brightness stays. (degrees,
    0 to 90, default 0.0)"""
    name: str
    """For people: nothing refers to it. Slashes make groups, as in a path: Truck/Wheels/Left."""


class DiskShape(TypedDict, total=False):
    """A flat disk; its front is where the normal points."""

    type: Required[Literal["disk"]]
    center: Required[list[float]]
    """The middle of the disk. (m)"""
    normal: Required[list[float]]
    """The direction in which its front faces, and shines."""
    radius: Required[float]
    """From the centre to the rim. (m, 0 to 1e+09)"""
    name: str
    """For people: nothing refers to it. Slashes make groups, as in a path: Truck/Wheels/Left."""
    material: Required[str]
    """The name of one of the scene's materials."""
    transform: Transform | MatrixTransform
    """Where the thing stands, how it is turned and how large it is."""
    visible_to_camera: bool
    """Off: the camera looks through it, but its light, shadow and reflections stay. (default True)"""


class DisneyMaterial(TypedDict, total=False):
    """The "principled" BRDF of Burley's 2012 course notes."""

    type: Required[Literal["disney"]]
    base_color: list[float] | float | str | ColorTexture
    """The colour of the surface, or of a metal's reflection. Real surfaces lie between 0.03 and 0.9. (0 to 1, default
    [0.5, 0.5, 0.5])"""
    subsurface: float | ScalarTexture
    """A flatter, softer shade, as of skin or wax. (0 to 1, default 0.0)"""
    metallic: float | ScalarTexture
    """0 is no metal, 1 is metal. Values between are for dust, rust or blends. (0 to 1, default 0.0)"""
    specular: float | ScalarTexture
    """How much the surface mirrors where you look straight at it: 0.5 is 4 %, as of plastic and glass. (0 to 1,
    default 0.5)"""
    specular_tint: float | ScalarTexture
    """Tints the reflection with the base colour where you look straight at it; the rim stays white. (0 to 1, default
    0.0)"""
    roughness: float | ScalarTexture
    """0 is polished, 1 is matte. (0 to 1, default 0.5)"""
    anisotropic: float | ScalarTexture
    """Stretches the highlight, as on brushed metal: at 1 it is ten times as long as wide. (0 to 1, default 0.0)"""
    sheen: float | ScalarTexture
    """A soft bright rim, as of cloth. (0 to 1, default 0.0)"""
    sheen_tint: float | ScalarTexture
    """Tints the sheen from white towards the base colour. (0 to 1, default 0.5)"""
    clearcoat: float | ScalarTexture
    """A thin layer of clear lacquer on top. (0 to 1, default 0.0)"""
    clearcoat_gloss: float | ScalarTexture
    """1 is a glossy lacquer, 0 a satin one. (0 to 1, default 1.0)"""
    emission: list[float] | float | str | dict[str, Any] | ColorTexture
    """The light that leaves the front side. Above 0 the thing is a lamp. (W/(m^2 sr), 0 to 1e+20, default [0.0, 0.0,
    0.0])"""
    emission_sides: Literal["front", "both"]
    """Whether only the front shines, or the back as well. (default 'front')"""
    alpha: float | ScalarTexture
    """1 is solid, 0.5 a fine mesh, 0 is not there at all. (0 to 1, default 1.0)"""
    alpha_cutoff: float | ScalarTexture
    """Cuts the shape out sharply: an opacity of at least this is solid, anything below is not there. (0 to 1)"""
    normal_map: NormalTexture
    """Small bumps: an image that changes how the surface catches the light, but not its outline."""
    height: HeightTexture
    """Relief: it changes how the surface catches the light, and moves the surface of meshes with displacement."""


class ImageEnvironment(TypedDict, total=False):
    """A latitude-longitude image; -Z is in its middle."""

    blur: float
    """Blurs the surroundings: less noise and softer shadows, but less true to the image. (degrees, 0 to 90, default
    0.0)"""
    type: Required[Literal["image"]]
    asset: Required[str]
    """A panorama of all directions, as an EXR or HDR file."""
    layer: str
    """Of an EXR that has several, by its name; without it the picture itself."""
    rotation: float
    """Turns the surroundings about the vertical, counter-clockwise seen from above. (degrees, default 0.0)"""
    scale: float
    """How bright the surroundings are. Twice as much is one stop. (0 to 1e+20, default 1.0)"""
    background: bool
    """Off: it lights the scene, but the picture is transparent where it would be seen. (default True)"""
    medium: Medium
    """What fills all space outside of bodies: fog, or the sea."""


class ImageTexture(TypedDict, total=False):
    """An image file; row 0 is v = 1, texel centres lie at (i + 0.5) / n."""

    asset: Required[str]
    """PNG, JPEG, WebP, EXR or Radiance HDR."""
    color_space: Literal["srgb", "linear"]
    """Without it 8-bit images in colours are sRGB, all others linear; alpha always is."""
    layer: str
    """Of an EXR that has several, by its name; without it the picture itself."""
    wrap: Literal["repeat", "clamp", "mirror"] | list[Literal["repeat", "clamp", "mirror"]]
    """What lies outside of the image: one word, or one for u and one for v. (default 'repeat')"""
    mapping: Literal["uv", "box", "sphere"]
    """By the shape's texture coordinates, or, without those: box, once a metre; sphere, once around the middle.
    (default 'uv')"""
    scale: list[float]
    """Factors on u and v, applied first: 2 shows the image twice. (default [1.0, 1.0])"""
    rotation: float
    """Turns u and v counter-clockwise about their origin, after the scale. (degrees, default 0.0)"""
    offset: list[float]
    """Added to u and v last. (default [0.0, 0.0])"""
    uv: int
    """Of a mesh's two sets of coordinates. (0 to 1, default 0)"""


class MeasuredMaterial(TypedDict, total=False):
    """Reflects as a real surface was measured: an uploaded MERL or RGL file has the values, per steradian.  Where the
    file has more light reflected than arrives, it is scaled down to all of it."""

    type: Required[Literal["measured"]]
    asset: Required[str]
    """A MERL .binary or an RGL .bsdf file."""
    emission: list[float] | float | str | dict[str, Any] | ColorTexture
    """The light that leaves the front side. Above 0 the thing is a lamp. (W/(m^2 sr), 0 to 1e+20, default [0.0, 0.0,
    0.0])"""
    emission_sides: Literal["front", "both"]
    """Whether only the front shines, or the back as well. (default 'front')"""
    alpha: float | ScalarTexture
    """1 is solid, 0.5 a fine mesh, 0 is not there at all. (0 to 1, default 1.0)"""
    alpha_cutoff: float | ScalarTexture
    """Cuts the shape out sharply: an opacity of at least this is solid, anything below is not there. (0 to 1)"""
    normal_map: NormalTexture
    """Small bumps: an image that changes how the surface catches the light, but not its outline."""
    height: HeightTexture
    """Relief: it changes how the surface catches the light, and moves the surface of meshes with displacement."""


class MeshShape(TypedDict, total=False):
    """Triangles, from a file (`asset`) or written out (`vertices` and `faces`)."""

    priority: int
    """Where glass, liquids and other clear bodies overlap, the one with the highest number is there. (-100 to 100,
    default 0)"""
    medium: Medium
    """What fills it, behind a surface that transmits."""
    type: Required[Literal["mesh"]]
    asset: str
    """A mesh file: OBJ, PLY, STL or GLB."""
    vertices: list[list[float]]
    """Rows of x, y, z. (m)"""
    faces: list[list[int]]
    """Rows of three vertex numbers, from 0, counter-clockwise seen from outside."""
    normals: list[list[float]]
    """One row per vertex."""
    uvs: list[list[float]]
    """One row of u and v per vertex; v points up."""
    colors: list[list[float]]
    """One row per vertex, linear, perhaps with alpha; they multiply the material's."""
    smooth: bool
    """On: rounded; off: with flat facets; neither: as the file says."""
    double_sided: bool
    """Off: from behind it is not there. (default True)"""
    displacement: bool
    """On: the height of the material moves the surface itself. (default False)"""
    max_edge: float
    """The longest edge of the triangles: shorter edges show finer relief and take more memory. (m, 0 to 1e+09)"""
    name: str
    """For people: nothing refers to it. Slashes make groups, as in a path: Truck/Wheels/Left."""
    material: Required[str]
    """The name of one of the scene's materials."""
    transform: Transform | MatrixTransform
    """Where the thing stands, how it is turned and how large it is."""
    visible_to_camera: bool
    """Off: the camera looks through it, but its light, shadow and reflections stay. (default True)"""


class MetalRoughMaterial(TypedDict, total=False):
    """The core BRDF of glTF 2.0: a metal or a dielectric of index 1.5, without coat."""

    type: Required[Literal["metal_rough"]]
    base_color: Required[list[float] | float | str | ColorTexture]
    """The colour of the surface, or of a metal's reflection. Real surfaces lie between 0.03 and 0.9. (0 to 1)"""
    metallic: Required[float | ScalarTexture]
    """0 is no metal, 1 is metal. Values between are for dust, rust or blends. (0 to 1)"""
    roughness: Required[float | ScalarTexture]
    """0 is polished, 1 is matte. (0 to 1)"""
    emission: list[float] | float | str | dict[str, Any] | ColorTexture
    """The light that leaves the front side. Above 0 the thing is a lamp. (W/(m^2 sr), 0 to 1e+20, default [0.0, 0.0,
    0.0])"""
    emission_sides: Literal["front", "both"]
    """Whether only the front shines, or the back as well. (default 'front')"""
    alpha: float | ScalarTexture
    """1 is solid, 0.5 a fine mesh, 0 is not there at all. (0 to 1, default 1.0)"""
    alpha_cutoff: float | ScalarTexture
    """Cuts the shape out sharply: an opacity of at least this is solid, anything below is not there. (0 to 1)"""
    normal_map: NormalTexture
    """Small bumps: an image that changes how the surface catches the light, but not its outline."""
    height: HeightTexture
    """Relief: it changes how the surface catches the light, and moves the surface of meshes with displacement."""


class MicrofacetMaterial(TypedDict, total=False):
    """Microfacets by the terms of the literature, for comparison and teaching: may lose or gain energy."""

    type: Required[Literal["microfacet"]]
    distribution: Literal["phong", "beckmann", "ggx", "gtr", "abc", "sgd", "gaussian"]
    """How the tiny facets of the surface are tilted (D). (default 'ggx')"""
    alpha: float | ScalarTexture
    """How wide the highlight is; for Phong an exponent, for ABC an inverse width. (0 to 1e+06, default 0.25)"""
    gamma: float
    """How soon the highlight fades towards its rim. (0 to 1000, default 2.0)"""
    geometry: Literal["implicit", "neumann", "cook_torrance", "kelemen", "schlick_ggx", "smith", "smith_correlated"]
    """How the tiny facets hide each other (G). (default 'smith')"""
    fresnel: Literal["none", "schlick", "cook_torrance", "dielectric", "conductor"]
    """How one facet mirrors (F). (default 'schlick')"""
    f0: list[float] | float | str | ColorTexture
    """How much is mirrored where you look straight at it. (0 to 1, default [0.04, 0.04, 0.04])"""
    ior: float
    """How strongly light is bent and mirrored: water 1.33, glass 1.5, diamond 2.42. (1 to 4, default 1.5)"""
    conductor_eta: list[float] | float
    """The index of refraction as measured, for red, green and blue. (1e-30 to 1e+09)"""
    conductor_k: list[float] | float
    """The extinction coefficient as measured, for red, green and blue. (0 to 1e+09)"""
    diffuse: list[float] | float | str | ColorTexture
    """The colour of the matte part, which is added to the highlight. (0 to 1, default [0.0, 0.0, 0.0])"""
    diffuse_model: Literal["lambert", "oren_nayar", "disney", "eon"]
    """How the matte part is shaded. (default 'lambert')"""
    diffuse_roughness: float
    """How flat the matte part looks, as clay or plaster do. (0 to 1, default 0.0)"""
    emission: list[float] | float | str | dict[str, Any] | ColorTexture
    """The light that leaves the front side. Above 0 the thing is a lamp. (W/(m^2 sr), 0 to 1e+20, default [0.0, 0.0,
    0.0])"""
    emission_sides: Literal["front", "both"]
    """Whether only the front shines, or the back as well. (default 'front')"""
    normal_map: NormalTexture
    """Small bumps: an image that changes how the surface catches the light, but not its outline."""
    height: HeightTexture
    """Relief: it changes how the surface catches the light, and moves the surface of meshes with displacement."""


class NoiseTexture(TypedDict, total=False):
    """Gradient noise, in one octave or in several (fBm): a smooth pattern without a period that anybody would see.
    With N the noise of one octave, which is 0 on average and lies in -1..1 (its standard deviation is about 0.25), n
    is the sum of gain^i N_i over the octaves i, divided by the sum of gain^i; each octave is `lacunarity` times as
    fine as the one before, turned, and has cells of its own. With `turbulence` N_i is its absolute value, so that n
    lies in 0..1. The texture's colour is a + (b - a) t, where t = 1/2 + contrast n / 2 or, with turbulence, t =
    contrast n, kept to 0..1. Its three channels are the colour's; it has no alpha."""

    type: Required[Literal["noise"]]
    a: list[float] | float | str | dict[str, Any]
    """The colour or value where the noise is lowest. (0 to 1e+20, default [0.0, 0.0, 0.0])"""
    b: list[float] | float | str | dict[str, Any]
    """The colour or value where it is highest. (0 to 1e+20, default [1.0, 1.0, 1.0])"""
    space: Literal["object", "uv"]
    """object: solid, as in marble or wood; uv: on the surface, along its texture coordinates. (default 'object')"""
    scale: list[float]
    """Cells of the first octave a metre along x, y and z, or along u and v; unequal numbers stretch the pattern.
    (default [4.0, 4.0, 4.0])"""
    offset: list[float]
    """Moves the pattern, in cells. (default [0.0, 0.0, 0.0])"""
    octaves: int
    """How many layers of finer detail there are. Each costs time. (1 to 10, default 4)"""
    lacunarity: float
    """How much finer each layer is than the one before. (1 to 4, default 2.0)"""
    gain: float
    """How strong each finer layer is: the roughness of the detail. (0 to 1, default 0.5)"""
    turbulence: bool
    """On: with creases, as in marble. (default False)"""
    contrast: float
    """How far the two colours stand apart. (0 to 1000, default 2.0)"""
    seed: int
    """Another number gives another pattern. (0 to 4.29497e+09, default 0)"""


class OpenpbrMaterial(TypedDict, total=False):
    """OpenPBR Surface 1.1.1: fuzz over a coat over metal, plastic or glass."""

    type: Required[Literal["openpbr"]]
    base_weight: float | ScalarTexture
    """How strong the base colour is. (0 to 1, default 1.0)"""
    base_color: list[float] | float | str | ColorTexture
    """The colour of the surface, or of a metal's reflection. Real surfaces lie between 0.03 and 0.9. (0 to 1, default
    [0.8, 0.8, 0.8])"""
    base_diffuse_roughness: float | ScalarTexture
    """0 is smooth; above it the surface looks flatter, as clay or plaster do. (0 to 1, default 0.0)"""
    base_metalness: float | ScalarTexture
    """0 is no metal, 1 is metal. Values between are for dust, rust or blends. (0 to 1, default 0.0)"""
    specular_weight: float | ScalarTexture
    """How strongly the surface mirrors. (0 to 1e+20, default 1.0)"""
    specular_color: list[float] | float | str | ColorTexture
    """Tints the reflection; of a metal, only its rim. (0 to 1, default [1.0, 1.0, 1.0])"""
    specular_roughness: float | ScalarTexture
    """0 is polished, 1 is matte. (0 to 1, default 0.3)"""
    specular_roughness_anisotropy: float | ScalarTexture
    """Stretches the highlight, as on brushed metal; above 0.9 nothing changes any more. (0 to 1, default 0.0)"""
    specular_ior: float | ScalarTexture
    """How strongly light is bent and mirrored: water 1.33, glass 1.5, diamond 2.42. A texture gives 1 to 4. (0.001 to
    1000, default 1.5)"""
    transmission_weight: float | ScalarTexture
    """How clear the material is: 1 is glass. (0 to 1, default 0.0)"""
    transmission_color: list[float] | float | str | ColorTexture
    """The colour of light that has gone through the material. (0 to 1, default [1.0, 1.0, 1.0])"""
    transmission_depth: float
    """How far light goes through the material until it has the transmission colour. 0: it is tinted at the surface.
    (m, 0 to 1e+09, default 0.0)"""
    transmission_scatter: list[float] | float | str
    """How milky the inside is. (0 to 1, default [0.0, 0.0, 0.0])"""
    transmission_scatter_anisotropy: float
    """Where light goes when it is scattered: above 0 onwards, below 0 back. (-1 to 1, default 0.0)"""
    transmission_dispersion_scale: float
    """How much light is split into colours, as by a prism: 0 is not at all. (0 to 1, default 0.0)"""
    transmission_dispersion_abbe_number: float
    """Splits light into colours as a prism does: the lower, the more. Flint 30, diamond 55, crown glass 60. (0 to
    1e+09, default 20.0)"""
    subsurface_weight: float | ScalarTexture
    """How much of the light wanders below the surface, as in skin, wax or milk. (0 to 1, default 0.0)"""
    subsurface_color: list[float] | float | str | ColorTexture
    """The colour that a thick piece of it has. (0 to 1, default [0.8, 0.8, 0.8])"""
    subsurface_radius: float
    """How far light goes below the surface between turns; 0: it comes back where it enters. (m, 0 to 1e+09, default
    1.0)"""
    subsurface_radius_scale: list[float] | float | str
    """A factor on the radius, per channel. (0 to 1, default [1.0, 0.5, 0.25])"""
    subsurface_scatter_anisotropy: float
    """Where light goes when it is scattered: above 0 onwards, below 0 back. (-1 to 1, default 0.0)"""
    coat_weight: float | ScalarTexture
    """How much of the surface is covered by clear lacquer. (0 to 1, default 0.0)"""
    coat_color: list[float] | float | str | ColorTexture
    """The tint of the lacquer. (0 to 1, default [1.0, 1.0, 1.0])"""
    coat_roughness: float | ScalarTexture
    """How rough the lacquer is: 0 is a perfect varnish. (0 to 1, default 0.0)"""
    coat_roughness_anisotropy: float | ScalarTexture
    """Stretches the highlight of the lacquer. (0 to 1, default 0.0)"""
    coat_ior: float | ScalarTexture
    """How strongly the lacquer bends and mirrors light: 1.5 to 1.6. (0.001 to 1000, default 1.6)"""
    coat_darkening: float | ScalarTexture
    """How much the lacquer deepens the colours under it, as varnish does wood. (0 to 1, default 1.0)"""
    fuzz_weight: float | ScalarTexture
    """How much of the surface is covered by fibres or dust. (0 to 1, default 0.0)"""
    fuzz_color: list[float] | float | str | ColorTexture
    """The colour of the fibres or the dust. (0 to 1, default [1.0, 1.0, 1.0])"""
    fuzz_roughness: float | ScalarTexture
    """How far the fuzz reaches inwards from the rim: cloth is low, dust high. (0 to 1, default 0.5)"""
    thin_film_weight: float | ScalarTexture
    """How much of the surface has a thin film, with the colours of a soap bubble. (0 to 1, default 0.0)"""
    thin_film_thickness: float | ScalarTexture
    """Soap 0.2 to 0.8, oxides of metals 0.03 to 0.2. (um, 0 to 1e+20, default 0.5)"""
    thin_film_ior: float | ScalarTexture
    """How strongly the film bends light: water 1.33, oil 1.47, oxides of metals 1.8 to 2.6. A texture gives 1 to 4.
    (0.001 to 1000, default 1.4)"""
    emission_luminance: float
    """The light that leaves the front side. Above 0 the thing is a lamp. (cd/m^2, 0 to 1e+20, default 0.0)"""
    emission_color: list[float] | float | str | dict[str, Any] | ColorTexture
    """The colour of the light. (0 to 1e+20, default [1.0, 1.0, 1.0])"""
    emission_sides: Literal["front", "both"]
    """Whether only the front shines, or the back as well. (default 'front')"""
    geometry_opacity: float | ScalarTexture
    """1 is solid, 0.5 a fine mesh, 0 is not there at all. (0 to 1, default 1.0)"""
    geometry_thin_walled: bool
    """A sheet without an inside, such as a window pane: light goes straight through. (default False)"""
    geometry_normal: NormalTexture
    """Small bumps: an image that changes how the surface catches the light, but not its outline."""
    geometry_tangent: list[float]
    """The direction in which highlights are stretched, along the texture coordinates u and v."""
    geometry_coat_normal: NormalTexture
    """Small bumps of the coat itself. Without it the coat is smooth, whatever lies under it."""
    geometry_coat_tangent: list[float]
    """The direction in which the highlights of the lacquer are stretched."""
    height: HeightTexture
    """Relief: it changes how the surface catches the light, and moves the surface of meshes with displacement."""


class OrthographicCamera(TypedDict, total=False):
    """Parallel rays from the plane through `position`: nothing gets smaller with its distance, as in plans."""

    type: Required[Literal["orthographic"]]
    height: Required[float]
    """What the picture shows from bottom to top. (m, 0 to 1e+09)"""
    position: Required[list[float]]
    """Where the camera stands. (m)"""
    target: Required[list[float]]
    """The point in the middle of the picture. (m)"""
    up: list[float]
    """The direction that is upward in the picture. (default [0.0, 1.0, 0.0])"""


class PanoramaCamera(TypedDict, total=False):
    """All directions around `position`, in latitude and longitude as an environment's image has them, and `target` in
    the middle of the picture."""

    type: Required[Literal["panorama"]]
    position: Required[list[float]]
    """Where the camera stands. (m)"""
    target: Required[list[float]]
    """The point in the middle of the picture. (m)"""
    up: list[float]
    """The direction that is upward in the picture. (default [0.0, 1.0, 0.0])"""


class PerspectiveCamera(TypedDict, total=False):
    """Looks through a lens: what is farther away is smaller."""

    type: Literal["perspective"]
    """default 'perspective'"""
    vfov: float
    """How much the picture takes in from top to bottom: 40 is a short telephoto, 75 a wide angle. (degrees, 0 to 180,
    default 40.0)"""
    aperture_radius: float
    """0 is sharp everywhere. Larger blurs what is out of focus. (m, 0 to 1e+09, default 0.0)"""
    focus_distance: float
    """How far away things are sharp. Without it, at the target. (m, 0 to 1e+09)"""
    position: Required[list[float]]
    """Where the camera stands. (m)"""
    target: Required[list[float]]
    """The point in the middle of the picture. (m)"""
    up: list[float]
    """The direction that is upward in the picture. (default [0.0, 1.0, 0.0])"""


class PhongMaterial(TypedDict, total=False):
    """The first highlight of all, about the mirrored direction; like `blinn_phong` it conserves no energy."""

    type: Required[Literal["phong"]]
    diffuse: Required[list[float] | float | str | ColorTexture]
    """Share of light that is sent back equally in all directions. (0 to 1)"""
    specular: Required[list[float] | float | str | ColorTexture]
    """The colour of the highlight. A sharper highlight sends back less light. (0 to 1)"""
    shininess: Required[float | ScalarTexture]
    """How tight the highlight is: 10 is dull, 100 is polished, 1000 is close to a mirror. (0 to 1e+20)"""
    ambient: list[float] | float | str | dict[str, Any] | ColorTexture
    """Light that is added wherever the surface is seen; it does not light other things. (W/(m^2 sr), 0 to 1e+20,
    default [0.0, 0.0, 0.0])"""
    emission: list[float] | float | str | dict[str, Any] | ColorTexture
    """The light that leaves the front side. Above 0 the thing is a lamp. (W/(m^2 sr), 0 to 1e+20, default [0.0, 0.0,
    0.0])"""
    emission_sides: Literal["front", "both"]
    """Whether only the front shines, or the back as well. (default 'front')"""
    alpha: float | ScalarTexture
    """1 is solid, 0.5 a fine mesh, 0 is not there at all. (0 to 1, default 1.0)"""
    alpha_cutoff: float | ScalarTexture
    """Cuts the shape out sharply: an opacity of at least this is solid, anything below is not there. (0 to 1)"""
    normal_map: NormalTexture
    """Small bumps: an image that changes how the surface catches the light, but not its outline."""
    height: HeightTexture
    """Relief: it changes how the surface catches the light, and moves the surface of meshes with displacement."""


class PointLight(TypedDict, total=False):
    """Shines equally in all directions, with 1/d^2; its shadows are sharp."""

    type: Required[Literal["point"]]
    position: Required[list[float]]
    """Where the light stands. (m)"""
    intensity: Required[list[float] | float | str | dict[str, Any]]
    """How bright it is: the light that falls on a surface 1 m away. (W/sr, 0 to 1e+20)"""
    name: str
    """For people: nothing refers to it. Slashes make groups, as in a path: Truck/Wheels/Left."""


class PrincipledMaterial(TypedDict, total=False):
    """The production model: reciprocal, never gains light, puts back what microfacets lose, and may be glass."""

    type: Required[Literal["principled"]]
    base_color: list[float] | float | str | ColorTexture
    """The colour of the surface, or of a metal's reflection. Real surfaces lie between 0.03 and 0.9. (0 to 1, default
    [0.5, 0.5, 0.5])"""
    subsurface: float | ScalarTexture
    """Share of the diffuse light that comes out beside where it went in; without a radius a flatter shade. (0 to 1,
    default 0.0)"""
    metallic: float | ScalarTexture
    """0 is no metal, 1 is metal. Values between are for dust, rust or blends. (0 to 1, default 0.0)"""
    specular: float | ScalarTexture
    """How much the surface mirrors where you look straight at it: 0.5 is 4 %, as of plastic and glass. (0 to 1,
    default 0.5)"""
    specular_tint: float | ScalarTexture
    """Tints the reflection with the base colour where you look straight at it; the rim stays white. (0 to 1, default
    0.0)"""
    roughness: float | ScalarTexture
    """0 is polished, 1 is matte. (0 to 1, default 0.5)"""
    anisotropic: float | ScalarTexture
    """Stretches the highlight, as on brushed metal: at 1 it is ten times as long as wide. (0 to 1, default 0.0)"""
    sheen: float | ScalarTexture
    """A soft bright rim, as of cloth. (0 to 1, default 0.0)"""
    sheen_tint: float | ScalarTexture
    """Tints the sheen from white towards the base colour. (0 to 1, default 0.5)"""
    clearcoat: float | ScalarTexture
    """A thin layer of clear lacquer on top. (0 to 1, default 0.0)"""
    clearcoat_gloss: float | ScalarTexture
    """1 is a glossy lacquer, 0 a satin one. (0 to 1, default 1.0)"""
    subsurface_radius: list[float] | float | str | dict[str, Any]
    """How far light goes below the surface between turns, per channel; without it, subsurface is a flatter shade. (m,
    0 to 1e+09)"""
    transmission: float | ScalarTexture
    """How clear the material is: 1 is glass. (0 to 1, default 0.0)"""
    ior: float | ScalarTexture
    """How strongly light is bent and mirrored: water 1.33, glass 1.5, diamond 2.42. It takes the place of specular.
    (1 to 4)"""
    abbe: float
    """Splits light into colours as a prism does: the lower, the more. Flint 30, diamond 55, crown glass 60. (0 to
    1e+09)"""
    attenuation_color: list[float] | float | str | ColorTexture
    """The colour of white light after the attenuation distance through the material. (0 to 1, default [1.0, 1.0,
    1.0])"""
    attenuation_distance: float | ScalarTexture
    """How far light goes through the material until it has the attenuation colour. Without it, the inside is clear.
    (m, 0 to 1e+09)"""
    thin_walled: bool
    """A sheet without an inside, such as a window pane or a leaf: light goes straight through. (default False)"""
    diffuse_transmission: float | ScalarTexture
    """How much light shines through, as through leaves and paper. Above 0 the thing is a thin sheet. (0 to 1, default
    0.0)"""
    diffuse_transmission_color: list[float] | float | str | ColorTexture
    """The colour of the light that shines through, in place of the base colour. (0 to 1)"""
    specular_color: list[float] | float | str | ColorTexture
    """Tints the reflection where you look straight at it; the rim stays white. (0 to 1, default [1.0, 1.0, 1.0])"""
    anisotropic_rotation: float | ScalarTexture
    """Turns the direction in which the highlight is stretched, counter-clockwise. (degrees, default 0.0)"""
    sheen_color: list[float] | float | str | ColorTexture
    """The colour of the sheen. It takes the place of the sheen tint. (0 to 1)"""
    sheen_roughness: float | ScalarTexture
    """How far the sheen reaches inwards from the rim: satin is low, wool high. (0 to 1, default 0.5)"""
    clearcoat_roughness: float | ScalarTexture
    """How rough the lacquer is: 0 is a perfect varnish. It takes the place of the gloss. (0 to 1)"""
    conductor_eta: list[float] | float
    """The index of refraction as measured, for red, green and blue. With k it takes the place of the base colour.
    (1e-30 to 1e+09)"""
    conductor_k: list[float] | float
    """The extinction coefficient as measured, for red, green and blue. It goes with n. (0 to 1e+09)"""
    film_thickness: float | ScalarTexture
    """A thin film with the colours of a soap bubble or of oil on water: soap 200 to 800, oxides of metals 30 to 200.
    (nm, 0 to 10000, default 0.0)"""
    film_ior: float | ScalarTexture
    """How strongly the film bends light: water 1.33, oil 1.47, oxides of metals 1.8 to 2.6. (1 to 4, default 1.4)"""
    clearcoat_normal_map: NormalTexture
    """Small bumps of the coat itself. Without it the coat is smooth, whatever lies under it."""
    emission: list[float] | float | str | dict[str, Any] | ColorTexture
    """The light that leaves the front side. Above 0 the thing is a lamp. (W/(m^2 sr), 0 to 1e+20, default [0.0, 0.0,
    0.0])"""
    emission_sides: Literal["front", "both"]
    """Whether only the front shines, or the back as well. (default 'front')"""
    alpha: float | ScalarTexture
    """1 is solid, 0.5 a fine mesh, 0 is not there at all. (0 to 1, default 1.0)"""
    alpha_cutoff: float | ScalarTexture
    """Cuts the shape out sharply: an opacity of at least this is solid, anything below is not there. (0 to 1)"""
    normal_map: NormalTexture
    """Small bumps: an image that changes how the surface catches the light, but not its outline."""
    height: HeightTexture
    """Relief: it changes how the surface catches the light, and moves the surface of meshes with displacement."""


class QuadShape(TypedDict, total=False):
    """A parallelogram; its front is where u, v and the normal are right-handed."""

    type: Required[Literal["quad"]]
    origin: Required[list[float]]
    """The corner that both edges start from. (m)"""
    u: Required[list[float]]
    """From the corner along the first edge. (m)"""
    v: Required[list[float]]
    """Along the second edge; the front faces cross(u, v). (m)"""
    name: str
    """For people: nothing refers to it. Slashes make groups, as in a path: Truck/Wheels/Left."""
    material: Required[str]
    """The name of one of the scene's materials."""
    transform: Transform | MatrixTransform
    """Where the thing stands, how it is turned and how large it is."""
    visible_to_camera: bool
    """Off: the camera looks through it, but its light, shadow and reflections stay. (default True)"""


class RampInput(TypedDict, total=False):
    """Another texture, which must be no ramp itself. A byte of an image counts as byte / 255 unless its texture says
    that it is sRGB."""

    texture: Required[str]
    """The name of one of the scene's textures."""
    channel: Literal["r", "g", "b", "a"]
    """Which of the texture's channels is read. (default 'r')"""


class RampStop(TypedDict, total=False):
    """A colour, and where the ramp has it."""

    position: Required[float]
    """Where on the ramp it lies, from 0 to 1. (0 to 1)"""
    color: Required[list[float] | float | str | dict[str, Any]]
    """The colour or value there. (0 to 1e+20)"""


class RampTexture(TypedDict, total=False):
    """Colours along a line, over a texture coordinate or over another texture.  With x the input, t = offset + scale
    x is brought to 0..1 as `wrap` says: kept there; its fraction; or its fraction by turns forwards and backwards.
    The stops count in the order of their positions, those of equal positions in the order in which they are given.
    Before the first stop and after the last the colour stays; in between, `interpolation` says whether it goes on in
    a straight line, keeps the colour of the stop before, or eases in and out (3 w^2 - 2 w^3)."""

    type: Required[Literal["ramp"]]
    input: Literal["u", "v"] | RampInput
    """What runs along the ramp: a texture coordinate, or another texture. (default 'u')"""
    stops: Required[list[RampStop]]
    """The colours along the ramp."""
    interpolation: Literal["linear", "constant", "smooth"]
    """How a colour becomes the next one. (default 'linear')"""
    scale: float
    """How often the ramp is run through: 2 runs through it twice, where it repeats. (default 1.0)"""
    offset: float
    """Moves the colours along the ramp. (default 0.0)"""
    wrap: Literal["clamp", "repeat", "mirror"]
    """What lies beyond the ramp's ends. (default 'clamp')"""


class SkyEnvironment(TypedDict, total=False):
    """A clear sky by day: Hosek and Wilkie's model of dome and sun, above Lambertian ground."""

    type: Required[Literal["sky"]]
    sun_elevation: Required[float]
    """Height of the sun: 0 is at the horizon, 90 overhead. (degrees, 0 to 90)"""
    sun_azimuth: Required[float]
    """Where the sun stands: 0 is -Z, 90 is +X. (degrees)"""
    turbidity: float
    """How hazy the air is: 1 is pure air, 3 a clear day, 6 hazy, 10 murky. (1 to 10, default 3.0)"""
    ground_albedo: float
    """How bright the ground is: 0.3 is soil and grass. (0 to 1, default 0.3)"""
    sun: bool
    """Off: the sky alone, as if the sun were hidden. (default True)"""
    rotation: float
    """Turns the surroundings about the vertical, counter-clockwise seen from above. (degrees, default 0.0)"""
    scale: float
    """How bright the surroundings are. Twice as much is one stop. (0 to 1e+20, default 1.0)"""
    background: bool
    """Off: it lights the scene, but the picture is transparent where it would be seen. (default True)"""
    medium: Medium
    """What fills all space outside of bodies: fog, or the sea."""


class SphereShape(TypedDict, total=False):
    """An exact sphere, not a mesh."""

    priority: int
    """Where glass, liquids and other clear bodies overlap, the one with the highest number is there. (-100 to 100,
    default 0)"""
    medium: Medium
    """What fills it, behind a surface that transmits."""
    type: Required[Literal["sphere"]]
    center: Required[list[float]]
    """The middle of the sphere. (m)"""
    radius: Required[float]
    """From the centre to the surface. (m, 0 to 1e+09)"""
    name: str
    """For people: nothing refers to it. Slashes make groups, as in a path: Truck/Wheels/Left."""
    material: Required[str]
    """The name of one of the scene's materials."""
    transform: Transform | MatrixTransform
    """Where the thing stands, how it is turned and how large it is."""
    visible_to_camera: bool
    """Off: the camera looks through it, but its light, shadow and reflections stay. (default True)"""


class SpotLight(TypedDict, total=False):
    """A point that shines into a cone: full inside the inner angle, fading to nothing at the outer."""

    type: Required[Literal["spot"]]
    position: Required[list[float]]
    """Where the light stands. (m)"""
    direction: Required[list[float]]
    """The direction in which the beam points."""
    intensity: Required[list[float] | float | str | dict[str, Any]]
    """How bright it is: the light that falls on a surface 1 m away, in the middle of the beam. (W/sr, 0 to 1e+20)"""
    inner_angle: Required[float]
    """From the middle of the beam to where the light begins to fade. (degrees, 0 to 90)"""
    outer_angle: Required[float]
    """From the middle of the beam to where nothing is left. The same as the inner angle gives a sharp edge. (degrees,
    0 to 90)"""
    name: str
    """For people: nothing refers to it. Slashes make groups, as in a path: Truck/Wheels/Left."""


Camera = PerspectiveCamera | OrthographicCamera | PanoramaCamera


Environment = ConstantEnvironment | ImageEnvironment | CubemapEnvironment | SkyEnvironment


Light = PointLight | SpotLight | DirectionalLight


Texture = ImageTexture | CheckerTexture | NoiseTexture | RampTexture


Material = (
    DiffuseMaterial
    | DisneyMaterial
    | PrincipledMaterial
    | OpenpbrMaterial
    | MetalRoughMaterial
    | BlinnPhongMaterial
    | PhongMaterial
    | MeasuredMaterial
    | MicrofacetMaterial
)


Shape = SphereShape | QuadShape | DiskShape | CylinderShape | BoxShape | MeshShape


class Scene(TypedDict, total=False):
    """What is to be rendered: camera, light, materials and shapes."""

    version: Required[Literal[1]]
    """Of this format."""
    camera: Required[Camera]
    """From where, and through what lens."""
    environment: Environment
    """What surrounds the scene; without one it is black."""
    lights: list[Light]
    """Lights that are no shapes."""
    textures: dict[str, Texture]
    """By names of your choice."""
    materials: Required[dict[str, Material]]
    """By names of your choice."""
    shapes: Required[list[Shape]]
    """Each made of one of the materials."""


class Settings(TypedDict, total=False):
    """How to render. What is left out comes from the quality."""

    width: int
    """Of the picture. (pixels, at least 1, default 512)"""
    height: int
    """Of the picture. (pixels, at least 1, default 512)"""
    max_samples: int
    """When to stop. Four times as many samples halve the noise. (1 to 1.67772e+07, default 256)"""
    max_bounces: int
    """How often light may be reflected: 0 shows lamps only, 1 direct light, more the light between things. (0 to
    1024, default 8)"""
    time_limit: float
    """Stops after this time. Without a number of samples, nothing else stops it. (s, 0 to 1e+09)"""
    target_noise: float
    """Stops when this little noise is left, as a share of the brightness: 0.01 looks clean. (0 to 1e+09)"""
    seed: int
    """Another number gives other noise, of the same strength. (0 to 4.29497e+09, default 0)"""
    quality: Literal["draft", "preview", "balanced", "high", "reference"]
    """Sets samples, bounces and roulette where they are not given. (default 'balanced')"""
    estimator: Literal["mis", "bsdf", "light", "uniform"]
    """How light is looked for. mis is the best; the others are for comparison. (default 'mis')"""
    sampler: Literal["sobol", "independent"]
    """How samples are spread. sobol spreads them evenly, and so needs fewer of them. (default 'sobol')"""
    filter: Literal["box", "tent", "gaussian", "blackman_harris"]
    """How soft the edges of pixels are: box is the sharpest, gaussian the softest. (default 'blackman_harris')"""
    roulette_depth: int
    """After how many bounces dim light may be given up: more speed for more noise. (0 to 1024, default 3)"""
    resolution_scale: float
    """A factor on the width and the height. (0 to 1, default 1.0)"""
    adaptive: bool
    """More samples where there is more noise, fewer elsewhere. (default False)"""
    clamp: float
    """Limits how bright reflected light can be: removes fireflies, and some light with them. (W/(m^2 sr), 0 to
    1e+20)"""
    caustics: Literal["light", "paths"]
    """How light that glass and mirrors gather is found. Left out, the way with less noise is taken."""
    filter_glossy: float
    """Blurs reflections within reflections: less noise, but less true. (0 to 1, default 0.0)"""
    denoise: bool
    """Filters noise out of the picture. (default False)"""
