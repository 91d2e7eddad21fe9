// The C border: checks handles and struct sizes, turns exceptions into statuses.
#include <exception>
#include <memory>
#include <new>
#include <string>

#include "pass_info.h"
#include "scene.h"
#include "session.h"
#include "sppm/sppm.h"
#include "status.h"

struct SppmScene {
  std::shared_ptr<sppm::Scene> scene = std::make_shared<sppm::Scene>();
};

struct SppmSession {
  sppm::Session session;
};

namespace {

using sppm::require;

thread_local std::string last_message;

SppmStatus fail(SppmStatus status, const char* function, const char* what) noexcept {
  try {
    last_message = std::string(function) + ": " + what;
  } catch (...) {
    last_message.clear();
  }
  return status;
}

// Runs the body of one exported function.
template <typename Body>
SppmStatus guard(const char* function, Body body) noexcept {
  try {
    body();
    return SPPM_OK;
  } catch (const sppm::Error& e) {
    return fail(e.status(), function, e.what());
  } catch (const std::bad_alloc&) {
    return fail(SPPM_OUT_OF_MEMORY, function, "not enough memory");
  } catch (const std::exception& e) {
    return fail(SPPM_INTERNAL_ERROR, function, e.what());
  } catch (...) {
    return fail(SPPM_INTERNAL_ERROR, function, "unknown exception");
  }
}

template <typename T>
void require_pointer(const T* pointer, const char* name) {
  require(pointer != nullptr, std::string(name) + " is null");
}

template <typename Desc>
void require_desc(const Desc* desc) {
  require_pointer(desc, "desc");
  require(desc->struct_size == sizeof(Desc), "struct_size is " + std::to_string(desc->struct_size) + ", must be " +
                                                 std::to_string(sizeof(Desc)) + ": built for another version of the header");
}

sppm::Scene& open(SppmScene* scene) {
  require_pointer(scene, "scene");
  if (scene->scene->committed()) throw sppm::Error(SPPM_INVALID_STATE, "the scene is committed and cannot be changed");
  return *scene->scene;
}

sppm::Scene& committed(SppmScene* scene) {
  require_pointer(scene, "scene");
  if (!scene->scene->committed()) throw sppm::Error(SPPM_INVALID_STATE, "the scene is not committed");
  return *scene->scene;
}

template <typename Desc, typename Add>
SppmStatus add(const char* function, SppmScene* scene, const Desc* desc, uint32_t* id, Add add_to) {
  return guard(function, [&] {
    sppm::Scene& target = open(scene);
    require_desc(desc);
    require_pointer(id, "the pointer for the id");
    *id = add_to(target);
  });
}

}  // namespace

extern "C" {

uint32_t sppm_abi_version(void) { return SPPM_ABI_VERSION; }

const char* sppm_version(void) {
  static const std::string version = std::string(SPPM_VERSION " (Embree ") + sppm::embree_version() + ", TBB " + sppm::tbb_version() + ")";
  return version.c_str();
}

const char* sppm_last_message(void) { return last_message.c_str(); }

SppmStatus sppm_self_test(void) {
  return guard(__func__, [] { sppm::check_embree(); });
}

SppmStatus sppm_scene_create(SppmScene** scene) {
  return guard(__func__, [&] {
    require_pointer(scene, "scene");
    *scene = new SppmScene;
  });
}

SppmStatus sppm_scene_add_image(SppmScene* scene, const SppmImageDesc* desc, uint32_t* image) {
  return add(__func__, scene, desc, image, [&](sppm::Scene& s) { return s.textures.add_image(*desc); });
}

SppmStatus sppm_scene_add_texture(SppmScene* scene, const SppmTextureDesc* desc, uint32_t* texture) {
  return add(__func__, scene, desc, texture, [&](sppm::Scene& s) { return s.textures.add_texture(*desc); });
}

SppmStatus sppm_scene_add_material(SppmScene* scene, const SppmMaterialDesc* desc, uint32_t* material) {
  return add(__func__, scene, desc, material, [&](sppm::Scene& s) { return s.materials.add(*desc); });
}

SppmStatus sppm_scene_add_mesh(SppmScene* scene, const SppmMeshDesc* desc, uint32_t* mesh) {
  return add(__func__, scene, desc, mesh, [&](sppm::Scene& s) { return s.add_mesh(*desc); });
}

SppmStatus sppm_scene_add_instance(SppmScene* scene, const SppmInstanceDesc* desc, uint32_t* instance) {
  return add(__func__, scene, desc, instance, [&](sppm::Scene& s) { return s.add_instance(*desc); });
}

SppmStatus sppm_scene_add_light(SppmScene* scene, const SppmLightDesc* desc, uint32_t* light) {
  return add(__func__, scene, desc, light, [&](sppm::Scene& s) { return s.add_lamp(*desc); });
}

SppmStatus sppm_scene_set_world(SppmScene* scene, const SppmWorldDesc* desc) {
  return guard(__func__, [&] {
    sppm::Scene& target = open(scene);
    require_desc(desc);
    target.lights.set_world(*desc);
  });
}

SppmStatus sppm_scene_set_camera(SppmScene* scene, const SppmCameraDesc* desc) {
  return guard(__func__, [&] {
    require_pointer(scene, "scene");
    require_desc(desc);
    scene->scene->set_camera(*desc);
  });
}

SppmStatus sppm_scene_set_camera_motion(SppmScene* scene, const SppmCameraDesc* keys, uint32_t count) {
  return guard(__func__, [&] {
    require_pointer(scene, "scene");
    for (uint32_t i = 0; i < count; ++i) require_desc(keys ? keys + i : nullptr);
    scene->scene->set_camera_motion({keys, count});
  });
}

SppmStatus sppm_scene_commit(SppmScene* scene, uint32_t threads) {
  return guard(__func__, [&] {
    sppm::Scene& target = open(scene);
    require(threads <= 4096, "threads must be at most 4096");
    target.commit(sppm::Threads(threads));
  });
}

SppmStatus sppm_scene_move_instance(SppmScene* scene, uint32_t instance, const float* transform) {
  return guard(__func__, [&] {
    sppm::Scene& target = committed(scene);
    require_pointer(transform, "transform");
    target.move_instance(instance, transform);
  });
}

SppmStatus sppm_scene_set_light(SppmScene* scene, uint32_t light, const SppmLightDesc* desc) {
  return guard(__func__, [&] {
    sppm::Scene& target = committed(scene);
    require_desc(desc);
    target.set_lamp(light, *desc);
  });
}

SppmStatus sppm_scene_update(SppmScene* scene, uint32_t threads) {
  return guard(__func__, [&] {
    sppm::Scene& target = committed(scene);
    require(threads <= 4096, "threads must be at most 4096");
    target.update(sppm::Threads(threads));
  });
}

SppmStatus sppm_scene_info(const SppmScene* scene, SppmSceneInfo* info) {
  return guard(__func__, [&] {
    require_pointer(scene, "scene");
    require_desc(info);
    if (!scene->scene->committed()) throw sppm::Error(SPPM_INVALID_STATE, "the scene is not committed");
    *info = scene->scene->info();
  });
}

void sppm_scene_destroy(SppmScene* scene) { delete scene; }

SppmStatus sppm_session_create(SppmScene* scene, const SppmSettings* settings, SppmSession** session) {
  return guard(__func__, [&] {
    require_pointer(scene, "scene");
    require_desc(settings);
    require_pointer(session, "session");
    if (!scene->scene->committed()) throw sppm::Error(SPPM_INVALID_STATE, "the scene is not committed");
    *session = new SppmSession{{scene->scene, *settings}};
  });
}

SppmStatus sppm_session_step(SppmSession* session) {
  return guard(__func__, [&] {
    require_pointer(session, "session");
    session->session.step();
  });
}

SppmStatus sppm_session_cancel(SppmSession* session) {
  return guard(__func__, [&] {
    require_pointer(session, "session");
    session->session.cancel();
  });
}

SppmStatus sppm_session_progress(const SppmSession* session, SppmProgress* progress) {
  return guard(__func__, [&] {
    require_pointer(session, "session");
    require_desc(progress);
    *progress = session->session.progress();
  });
}

SppmStatus sppm_pass_channels(uint32_t pass, uint32_t* channels) {
  return guard(__func__, [&] {
    require(pass < SPPM_PASS_COUNT, "pass must be an SppmPass");
    require_pointer(channels, "channels");
    *channels = sppm::kPasses[pass].channel_count();
  });
}

SppmStatus sppm_session_read_pass(const SppmSession* session, uint32_t pass, float* out, uint64_t count) {
  return guard(__func__, [&] {
    require_pointer(session, "session");
    require(pass < SPPM_PASS_COUNT, "pass must be an SppmPass");
    require_pointer(out, "out");
    session->session.read_pass(static_cast<SppmPass>(pass), out, count);
  });
}

SppmStatus sppm_session_write_exr(const SppmSession* session, const char* path) {
  return guard(__func__, [&] {
    require_pointer(session, "session");
    require_pointer(path, "path");
    session->session.write_exr(path);
  });
}

void sppm_session_destroy(SppmSession* session) { delete session; }

}  // extern "C"
