/* SPPM: stochastic progressive photon mapping as a C library.
 *
 * Rules that hold for every function here:
 *  - A function that can fail returns an SppmStatus; its result goes to the last, out-pointer argument, which is untouched on failure.
 *    `sppm_last_message` then tells, for the calling thread, which function and field, the value given and the values allowed.
 *  - Handles are opaque. Destroying NULL does nothing. A session keeps its scene alive, so a scene may be destroyed while sessions use it.
 *  - A description struct starts with its own size (`struct_size = sizeof(struct)`), which must be that of this header: any change of a
 *    struct raises SPPM_ABI_VERSION.
 *  - The library copies what it is given: no pointer is kept after the call returns.
 *  - Ids returned by `sppm_scene_add_*` start at 1; 0 means "none".
 *  - Matrices are row-major 3x4, object to world. Right-handed frames; the camera looks along its -z with +y up, as in Blender.
 *  - Images and passes are float32, rows from bottom to top, pixels from left to right, channels interleaved.
 *  - Units: metres, watts, steradians. Colours are linear RGB, in whatever linear RGB space the caller uses throughout.
 *  - No exception leaves the library, nothing is printed, the environment is not read, and there is no global state but the
 *    thread's last message.
 *  - `sppm_session_cancel` and `sppm_session_progress` may be called from any thread at any time; everything else that touches one
 *    handle must not run concurrently with other calls on that handle.
 */
#ifndef SPPM_SPPM_H
#define SPPM_SPPM_H

#include <stdint.h>

#if defined(__GNUC__)
#define SPPM_API __attribute__((visibility("default")))
#else
#define SPPM_API
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* Raised whenever a caller built for another header could misread a struct. Compare with sppm_abi_version() at load. */
#define SPPM_ABI_VERSION 4

typedef enum SppmStatus {
  SPPM_OK = 0,
  SPPM_INVALID_ARGUMENT = 1, /* a value outside what the field allows; the message names it */
  SPPM_INVALID_STATE = 2,    /* right call at the wrong time, e.g. adding to a committed scene */
  SPPM_OUT_OF_MEMORY = 3,
  SPPM_IO_ERROR = 4,       /* a file could not be written */
  SPPM_UNSUPPORTED = 5,    /* the process has an Embree that this library was not built for */
  SPPM_INTERNAL_ERROR = 6, /* a bug: please report the message */
  SPPM_CANCELLED = 7       /* the step was given up; the state is that of the iteration before */
} SppmStatus;

typedef struct SppmScene SppmScene;
typedef struct SppmSession SppmSession;

/* ---------------------------------------------------------------- library */

SPPM_API uint32_t sppm_abi_version(void);
/* "MAJOR.MINOR.PATCH (Embree x.y.z, TBB x)". Static storage. */
SPPM_API const char *sppm_version(void);
/* What went wrong in this thread's last failed call; "" if none failed. Valid until the thread's next call. */
SPPM_API const char *sppm_last_message(void);
/* Traces one ray whose answer is known through the Embree that this process really calls. Fails with SPPM_UNSUPPORTED where another
 * library shadows ours (two Embree versions share symbol names, and then every ray misses without an error). */
SPPM_API SppmStatus sppm_self_test(void);

/* ------------------------------------------------------------------ scene */

typedef enum SppmColorEncoding {
  SPPM_LINEAR = 0,
  SPPM_SRGB = 1 /* stored with the sRGB curve; filtered as stored, then decoded; alpha is never decoded */
} SppmColorEncoding;

/* An image. `pixels` float32 (height, width, 4) RGBA, straight alpha, or, when `pixels_u8` is set instead, uint8 of the same shape. */
typedef struct SppmImageDesc {
  uint64_t struct_size;
  uint64_t width, height;
  const float *pixels;
  const uint8_t *pixels_u8;
  uint32_t encoding; /* SppmColorEncoding */
  const char *name;  /* for messages; may be NULL */
} SppmImageDesc;

typedef enum SppmTextureType {
  SPPM_TEXTURE_CONSTANT = 0,  /* `value` */
  SPPM_TEXTURE_IMAGE = 1,     /* image colour at mapping * (u, v, 0) */
  SPPM_TEXTURE_IMAGE_ALPHA = 2, /* the image's alpha, as grey */
  SPPM_TEXTURE_ATTRIBUTE = 3, /* the mesh's corner colours */
  SPPM_TEXTURE_MIX = 4        /* blend(a, b) by factor */
} SppmTextureType;

typedef enum SppmInterpolation { SPPM_LINEAR_FILTER = 0, SPPM_CLOSEST = 1 } SppmInterpolation;
typedef enum SppmExtension { SPPM_REPEAT = 0, SPPM_EXTEND = 1, SPPM_CLIP = 2, SPPM_MIRROR = 3 } SppmExtension;
typedef enum SppmBlend { SPPM_BLEND_MIX = 0, SPPM_BLEND_MULTIPLY = 1, SPPM_BLEND_ADD = 2, SPPM_BLEND_SUBTRACT = 3,
  SPPM_BLEND_SCREEN = 4, SPPM_BLEND_DIFFERENCE = 5, SPPM_BLEND_DARKEN = 6, SPPM_BLEND_LIGHTEN = 7 } SppmBlend;

/* A colour that varies over a surface. A texture may refer to textures added before it, so there are no cycles; it may rest on 255 of
 * them, directly or through others. */
typedef struct SppmTextureDesc {
  uint64_t struct_size;
  uint32_t type; /* SppmTextureType */
  float value[3];
  uint32_t image;
  uint32_t interpolation, extension; /* SppmInterpolation, SppmExtension */
  float mapping[12];                 /* 3x4 applied to (u, v, 0); identity if all zero */
  uint32_t blend;                    /* SppmBlend: result = a (1 - factor) + blend(a, b) factor */
  uint32_t a, b, factor;             /* textures; `factor` uses the first channel */
} SppmTextureDesc;

/* value * texture (per channel); the texture counts as 1 where `texture` is 0. Scalars use the first channel. */
typedef struct SppmParam {
  float value[3];
  uint32_t texture;
} SppmParam;

typedef enum SppmClosureType {
  SPPM_DIFFUSE = 1,     /* Lambert reflection, albedo `color`; with SPPM_CLOSURE_RETRO Disney's diffuse, using `roughness` */
  SPPM_DIELECTRIC = 2,  /* interface of index `ior` (inside over outside): reflection tint `color`, transmission tint `color2` */
  SPPM_CONDUCTOR = 3,   /* reflection: `color` at normal incidence, `color2` at grazing (Schlick) */
  SPPM_COAT = 4,        /* reflection of a dielectric of index `ior`, tint `color`; lies over the closures after it in the list, up to
                         * the next coat, with ATTENUATE over the share `color2` (its luminance) of them */
  SPPM_TRANSPARENT = 5, /* light goes straight on, times `color` */
  SPPM_EMISSION = 6     /* radiance `color` [W m^-2 sr^-1] from both sides, less what a coat over it takes */
} SppmClosureType;

typedef enum SppmClosureFlags {
  SPPM_CLOSURE_RETRO = 1,           /* DIFFUSE: Disney's retro-reflective diffuse instead of Lambert */
  SPPM_CLOSURE_PRESERVE_ENERGY = 2, /* rough DIELECTRIC, CONDUCTOR, COAT: give back what multiple scattering loses */
  SPPM_CLOSURE_ATTENUATE = 4,       /* COAT: closures after it get what its albedo leaves, not their full weight */
  SPPM_CLOSURE_REFRACTION_ONLY = 8, /* DIELECTRIC: all transmission, no Fresnel reflection (Blender's Refraction BSDF) */
  SPPM_CLOSURE_EDGE_BY_IOR = 16, /* CONDUCTOR: goes from `color` to `color2` as a dielectric of index `ior` does, not as Schlick has it */
  SPPM_CLOSURE_SEPARABLE = 32, /* rough DIELECTRIC, CONDUCTOR, COAT as in Cycles before 4.0: masking and shadowing are independent, and
                                 the shares of reflection and transmission are those at the shading normal toward the camera's side */
  SPPM_CLOSURE_UNDER_COAT = 64, /* COAT with ATTENUATE: lies beneath the one before it, which covers what follows as well */
  SPPM_CLOSURE_CLEARCOAT = 128, /* rough COAT as Principled before 4.0 has its clearcoat: the light's side is masked as by alpha 0.25 */
  SPPM_CLOSURE_SMOOTH_ALBEDO = 256 /* rough CONDUCTOR, COAT as in Cycles before 4.0: passes show the albedo that a smooth one has */
} SppmClosureFlags;

typedef struct SppmClosureDesc {
  uint64_t struct_size;
  uint32_t type;  /* SppmClosureType */
  uint32_t flags; /* SppmClosureFlags */
  SppmParam weight;    /* of this closure in the sum, >= 0 */
  SppmParam color;     /* see the type */
  SppmParam color2;    /* see the type */
  SppmParam roughness; /* 0 to 1; the microfacet alpha is its square (GGX) */
  float ior;           /* DIELECTRIC, COAT, and CONDUCTOR with EDGE_BY_IOR: > 0 */
} SppmClosureDesc;

/* The sum of its closures; without any it is black. */
typedef struct SppmMaterialDesc {
  uint64_t struct_size;
  uint64_t closure_count; /* at most 16 */
  const SppmClosureDesc *closures;
  uint32_t index; /* that MATERIAL_INDEX shows */
  const char *name;
} SppmMaterialDesc;

/* Triangles in object space. Corner attributes are indexed by `corners`. */
typedef struct SppmMeshDesc {
  uint64_t struct_size;
  uint64_t vertex_count, triangle_count, corner_count;
  const float *positions;       /* (vertex_count, 3), metres */
  const uint32_t *indices;      /* (triangle_count, 3) into positions */
  const uint32_t *corners;      /* (triangle_count, 3) into the corner arrays; may be NULL if there are none */
  const float *corner_normals;  /* (corner_count, 3) unit; NULL: flat */
  const float *corner_uvs;      /* (corner_count, 2); NULL: no UV map */
  const float *corner_colors;   /* (corner_count, 3) linear; NULL: no colours */
  const uint32_t *material_slots; /* (triangle_count) index into an instance's materials; NULL: all 0 */
  const char *name;
} SppmMeshDesc;

typedef enum SppmInstanceFlags {
  SPPM_INSTANCE_HOLDOUT = 1,           /* what the camera sees of it, directly or through what is transparent, is cut out of the picture */
  SPPM_INSTANCE_HIDDEN_FROM_CAMERA = 2 /* camera rays pass through it until they are scattered */
} SppmInstanceFlags;

typedef struct SppmInstanceDesc {
  uint64_t struct_size;
  uint32_t mesh;
  uint32_t material_count;   /* at least the mesh's largest slot + 1 */
  const uint32_t *materials; /* material ids */
  float transform[12];       /* may squeeze the mesh flat */
  uint32_t flags;            /* SppmInstanceFlags */
  uint32_t index;            /* that OBJECT_INDEX shows */
  const char *name;
  uint32_t movable;          /* sppm_scene_move_instance may be called for it; its rays take a little longer */
  uint32_t motion_count;     /* > 0: it moves while the shutter is open, */
  const float *motion;       /* (motion_count, 12): from place to place, evenly spaced in time from its opening to its closing */
} SppmInstanceDesc;

typedef enum SppmLightType {
  SPPM_LIGHT_POINT = 1,   /* `emission` = radiant intensity [W sr^-1]; a sphere of `radius` or, at 0, a point */
  SPPM_LIGHT_SPOT = 2,    /* the same, within a cone about -z of the transform */
  SPPM_LIGHT_SUN = 3,     /* `emission` = irradiance on a plane facing it [W m^-2]; light travels along -z; cone `angle` */
  SPPM_LIGHT_RECTANGLE = 4, /* `emission` = radiance; size_x by size_y in the transform's xy plane, emits to -z */
  SPPM_LIGHT_ELLIPSE = 5    /* the same with the ellipse of diameters size_x, size_y */
} SppmLightType;

typedef enum SppmLightFlags {
  SPPM_LIGHT_NO_SHADOW = 1,   /* direct light ignores what stands between */
  SPPM_LIGHT_SPOT_COSINE = 2, /* SPOT: fall-off times the cosine to the axis (Blender before 4.0) */
  SPPM_LIGHT_HIDDEN_FROM_SPECULAR = 4 /* not seen in mirrors nor through glass */
} SppmLightFlags;

typedef struct SppmLightDesc {
  uint64_t struct_size;
  uint32_t type;  /* SppmLightType */
  uint32_t flags; /* SppmLightFlags */
  float transform[12]; /* rotation and translation; scale in x, y applies to the sizes of RECTANGLE and ELLIPSE only */
  float emission[3];
  float radius;         /* POINT, SPOT, metres */
  float angle;          /* SPOT: full cone; SUN: full angular diameter; radians */
  float blend;          /* SPOT: 0 hard to 1 soft edge: smoothstep of (cos t - cos h) / ((1 - cos h) blend), h half the cone */
  float size_x, size_y; /* metres */
  const char *name;
  uint32_t motion_count; /* as of SppmInstanceDesc */
  const float *motion;
} SppmLightDesc;

typedef struct SppmWorldDesc {
  uint64_t struct_size;
  float radiance[3];  /* constant, or factor of the image */
  uint32_t image;     /* equirectangular, Blender's convention: u = 1/2 - atan2(y, x)/(2 pi) wraps, v = 1/2 + asin(z)/pi; 0: none */
  float rotation[9];  /* row-major 3x3, world direction to image direction; identity if all zero */
  uint32_t hidden_from_camera; /* camera rays that leave the scene see black (alpha as if hit nothing) */
} SppmWorldDesc;

typedef enum SppmProjection { SPPM_PERSPECTIVE = 0, SPPM_ORTHOGRAPHIC = 1 } SppmProjection;

/* The camera and the part of its image to render. */
typedef struct SppmCameraDesc {
  uint64_t struct_size;
  uint32_t projection;
  float transform[12];      /* camera to world, no scale */
  float window[4];          /* left, right, bottom, top of the full image: at distance 1 (PERSPECTIVE) or in metres */
  float clip_near, clip_far; /* depth along -z, metres */
  float aperture_radius;    /* thin lens, metres; 0: pinhole */
  float aperture_ratio;     /* bokeh width/height divisor as Blender's; 0 counts as 1 */
  float focal_distance;     /* depth along -z, metres */
  uint64_t width, height;   /* of the full image, pixels */
  uint64_t region_x, region_y, region_width, region_height; /* rendered part, from the bottom left; region_width 0: all */
} SppmCameraDesc;

SPPM_API SppmStatus sppm_scene_create(SppmScene **scene);
SPPM_API SppmStatus sppm_scene_add_image(SppmScene *scene, const SppmImageDesc *desc, uint32_t *image);
SPPM_API SppmStatus sppm_scene_add_texture(SppmScene *scene, const SppmTextureDesc *desc, uint32_t *texture);
SPPM_API SppmStatus sppm_scene_add_material(SppmScene *scene, const SppmMaterialDesc *desc, uint32_t *material);
SPPM_API SppmStatus sppm_scene_add_mesh(SppmScene *scene, const SppmMeshDesc *desc, uint32_t *mesh);
SPPM_API SppmStatus sppm_scene_add_instance(SppmScene *scene, const SppmInstanceDesc *desc, uint32_t *instance);
SPPM_API SppmStatus sppm_scene_add_light(SppmScene *scene, const SppmLightDesc *desc, uint32_t *light);
SPPM_API SppmStatus sppm_scene_set_world(SppmScene *scene, const SppmWorldDesc *desc);
/* This and the next are legal after sppm_scene_commit too, at once and without sppm_scene_update, while no session of the scene is in a
 * step; a session's picture must keep its size. This ends a camera's motion. */
SPPM_API SppmStatus sppm_scene_set_camera(SppmScene *scene, const SppmCameraDesc *desc);
/* A camera that moves while the shutter is open: `count` cameras evenly spaced in time, alike in projection, size and region.
 *
 * Where anything moves, each iteration of a session renders the scene as it is at one time, and the times of all fill the shutter evenly;
 * they depend on the seed and on the iteration alone. What lies between two places is interpolated as translation, rotation and
 * stretch. Sessions of such a scene wait for each other. */
SPPM_API SppmStatus sppm_scene_set_camera_motion(SppmScene *scene, const SppmCameraDesc *keys, uint32_t count);
/* Builds BVH and light distribution with up to `threads` threads (0: all cores). Afterwards only what stands below may change. A scene
 * without geometry, lights or world is legal; one without a camera is not. */
SPPM_API SppmStatus sppm_scene_commit(SppmScene *scene, uint32_t threads);

/* Moving what is in a committed scene. No session of the scene may be in a step meanwhile; what a session has rendered is not forgotten,
 * so a picture of the new places alone needs a new session. sppm_scene_update carries it out, before the next step: until then everything
 * shows as it was. Then the scene renders to the bits as one that was built so. What is moved or replaced ends its motion. */
SPPM_API SppmStatus sppm_scene_move_instance(SppmScene *scene, uint32_t instance, const float *transform); /* 12 floats */
/* Replaces a lamp by another one, of whatever type, in whatever place. */
SPPM_API SppmStatus sppm_scene_set_light(SppmScene *scene, uint32_t light, const SppmLightDesc *desc);
SPPM_API SppmStatus sppm_scene_update(SppmScene *scene, uint32_t threads);

typedef struct SppmSceneInfo {
  uint64_t struct_size;
  uint64_t triangle_count, instance_count, light_count; /* after commit; an emitting mesh instance counts as one light */
  double light_power;    /* total radiant power, luminance of RGB [W]; sun and world: what passes the scene's bounding sphere */
  double bounds_min[3], bounds_max[3];
  uint64_t memory_bytes; /* estimate, BVH included */
  uint32_t has_specular, has_transparent, has_textures; /* what the scene needs */
} SppmSceneInfo;
SPPM_API SppmStatus sppm_scene_info(const SppmScene *scene, SppmSceneInfo *info);
SPPM_API void sppm_scene_destroy(SppmScene *scene);

/* ---------------------------------------------------------------- session */

typedef enum SppmPixelFilter { SPPM_BLACKMAN_HARRIS = 0, SPPM_BOX = 1 } SppmPixelFilter;

/* DEPTH, POSITION and the indices are those of the visible surface behind the middle of a pixel, not filtered, and where things move at
 * the time of the first iteration; all others are averages over its camera paths. "Seen by the camera" includes through what is
 * transparent. A pass that is not asked for takes neither memory nor time; DEPTH, NORMAL and those from POSITION on take 8 bytes a pixel
 * and channel. */
typedef enum SppmPass {
  SPPM_PASS_COMBINED = 0, /* RGBA, alpha 1 unless the film is transparent or a holdout cuts it out; colour premultiplied */
  SPPM_PASS_DEPTH = 1,    /* 1 channel: depth along the camera's -z (PERSPECTIVE: distance to the camera plane); 1e10 where nothing */
  SPPM_PASS_NORMAL = 2,   /* 3: shading normal of the visible surface, world, toward the camera */
  SPPM_PASS_DIRECT = 3,   /* 3: emission, environment and direct light */
  SPPM_PASS_INDIRECT = 4, /* 3: light that other surfaces scattered before, by photons or by paths, less what is in CAUSTICS */
  SPPM_PASS_CAUSTICS = 5, /* 3: photons that reached a diffuse surface by specular ones only; what is rough counts with the share that
                              photons carry of it, or, without `aim_photons`, all */
  SPPM_PASS_RADIUS = 6,   /* 1: search radius of the caustic photons [m] where the pixel has one, else of the others; by DENSITY a pixel's
                              filter may ask for more */
  SPPM_PASS_PHOTONS = 7,  /* 1: photons found of both kinds; but for PASS_INDEXED those found in wider disks count less */
  SPPM_PASS_POSITION = 8, /* 3: of the visible surface plus `origin` [m] */
  SPPM_PASS_UV = 9,       /* 3: of the visible surface: u, v, 1; 0 where its mesh has none */
  SPPM_PASS_OBJECT_INDEX = 10,  /* 1: the instance's */
  SPPM_PASS_MATERIAL_INDEX = 11, /* 1 */
  SPPM_PASS_MIST = 12,     /* 1: 0 within `mist_start` of the camera to 1 `mist_depth` behind it, and where nothing is */
  SPPM_PASS_EMISSION = 13, /* 3: of surfaces that the camera sees */
  SPPM_PASS_ENVIRONMENT = 14, /* 3: that the camera sees, on a transparent film too */
  SPPM_PASS_DIFFUSE_COLOR = 15, /* 3: albedo of the diffuse lobes that the camera sees */
  SPPM_PASS_DENOISING_ALBEDO = 16, /* 3: of the first surface that is not specular, times the tints of those before; light where a
                                      path meets it first */
  SPPM_PASS_DENOISING_NORMAL = 17, /* 3: of that surface, in a camera frame that looks along its +z */
  SPPM_PASS_COUNT = 18
} SppmPass;

/* Who finds the light that is neither direct nor a caustic. */
typedef enum SppmIndirect {
  SPPM_INDIRECT_PHOTONS = 0, /* photons from the lights to anywhere, gathered at the first diffuse surface that is seen */
  SPPM_INDIRECT_PATHS = 1,   /* camera paths that go on there; photons are left with what goes through specular surfaces first */
  SPPM_INDIRECT_AUTO = 2     /* PHOTONS where a first iteration finds enough of them at most pixels, else PATHS */
} SppmIndirect;

/* How the search radius of a pixel shrinks from one iteration to the next. */
typedef enum SppmRadiusRule {
  SPPM_RADIUS_PROGRESSIVE = 0, /* r'^2 = r^2 (N + gamma M) / (N + M), M photons found in the iteration and N kept before */
  SPPM_RADIUS_DENSITY = 1,     /* of the least error, by how the density of photons found before bends from pixel to pixel; for caustics
                                  near edges and where nothing was found also by what PASS_INDEXED shrinks it by; over no less than
                                  the pixel's filter where it sees one surface and nothing moves */
  SPPM_RADIUS_PASS_INDEXED = 2 /* r'^2 = r^2 (i + gamma) / (i + 1) after iteration i, whatever was found */
} SppmRadiusRule;

typedef struct SppmSettings {
  uint64_t struct_size;
  uint64_t iterations;            /* >= 1 */
  uint64_t photons_per_iteration; /* shared by the kinds of photons; 0: so many that their rays are about as many as camera paths' */
  double initial_radius;          /* metres; 0: automatic, from the footprint of pixels at what they see */
  uint32_t max_depth;             /* vertices of a path, 1 to 1024 */
  uint32_t pixel_filter;          /* SppmPixelFilter */
  double filter_width;            /* pixels, > 0: the reach to either side of BLACKMAN_HARRIS, the whole width of BOX, as in Cycles */
  double gamma;                   /* 0 < gamma < 1, see SppmRadiusRule: smaller shrinks faster */
  uint64_t seed;
  double time_limit;              /* seconds of wall time, 0: none; the iteration under way is finished */
  uint64_t write_interval;        /* iterations between snapshots; 0: none */
  const char *snapshot_path;      /* EXR file to write them to; NULL: none */
  uint32_t threads;               /* 0: all cores */
  uint32_t transparent_film;      /* environment seen by camera rays is transparent */
  uint64_t passes;                /* bit (1 << SppmPass) for each pass that will be read; COMBINED is always there */
  uint32_t indirect;              /* SppmIndirect */
  uint32_t radius_rule;           /* SppmRadiusRule */
  uint32_t aim_photons;           /* photons that caustics are made of leave toward the surfaces that throw them only */
  float alpha_threshold;          /* 0 to 1: the visible surface is the first that is at least so opaque */
  float mist_start, mist_depth;   /* metres; no mist if the depth is 0 */
  float mist_power;               /* MIST is this power of the share of `mist_depth` */
  double origin[3];               /* metres, of the scene in the caller's world: added to POSITION */
} SppmSettings;

typedef struct SppmProgress {
  uint64_t struct_size;
  uint64_t iteration;       /* finished ones */
  uint64_t photons_emitted; /* paths started */
  uint64_t photons_stored;  /* deposits that a visible point could use */
  uint64_t rays_camera, rays_shadow, rays_photon;
  uint64_t dropped_samples; /* non-finite samples that were left out */
  double seconds;           /* wall time spent in steps */
  double seconds_camera, seconds_photons, seconds_grid, seconds_gather;
  uint64_t memory_bytes;    /* estimate of the session's own state */
  uint32_t finished;        /* all iterations done or the time limit reached */
  uint32_t indirect;        /* SppmIndirect in use; AUTO before the first iteration has decided */
} SppmProgress;

/* `scene` must be committed. */
SPPM_API SppmStatus sppm_session_create(SppmScene *scene, const SppmSettings *settings, SppmSession **session);
/* One iteration: camera pass, photon pass, lookup, update. Legal after `finished`: it renders one more. */
SPPM_API SppmStatus sppm_session_step(SppmSession *session);
/* Makes a running step return SPPM_CANCELLED soon (a step not yet begun as well, once). */
SPPM_API SppmStatus sppm_session_cancel(SppmSession *session);
SPPM_API SppmStatus sppm_session_progress(const SppmSession *session, SppmProgress *progress);
SPPM_API SppmStatus sppm_pass_channels(uint32_t pass, uint32_t *channels);
/* Fills `out`, float32 (region_height, region_width, channels); `count` is the number of floats it has room for and must be exact.
 * Before the first iteration all passes are zero. */
SPPM_API SppmStatus sppm_session_read_pass(const SppmSession *session, uint32_t pass, float *out, uint64_t count);
/* Writes the requested passes as one multi-channel OpenEXR file (float, ZIP) with settings and statistics in its header. */
SPPM_API SppmStatus sppm_session_write_exr(const SppmSession *session, const char *path);
SPPM_API void sppm_session_destroy(SppmSession *session);

#ifdef __cplusplus
}
#endif

#endif
