// SPDX-License-Identifier: Apache-2.0
//
// Embree under the clock. Written for Embree 3; with ZKD_BENCH_EMBREE set to 4, for Embree 4.
#include "peers_embree.hpp"

#if ZKD_BENCH_EMBREE == 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#if defined(__x86_64__)
#include <xmmintrin.h>
#endif

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <string>
#include <utility>

#include <zkd/error.hpp>

namespace zkd::bench {
namespace {

constexpr int batch = 256;  // rays a thread takes at a time
constexpr int packet = 8;

// Positions and faces as Embree wants them: it may read 16 bytes at the last position.
struct PaddedMesh {
  explicit PaddedMesh(const scene::Mesh& mesh)
      : positions(mesh.positions), faces(mesh.faces), position_count(mesh.positions.size()) {
    positions.emplace_back(0.0F);
  }

  std::vector<glm::vec3> positions;
  std::vector<glm::uvec3> faces;
  std::size_t position_count;
};

// Embree's account of its own memory; its threads report.
class MemoryAccount {
 public:
  static bool report(void* account, ssize_t bytes, bool) {
    static_cast<MemoryAccount*>(account)->add(bytes);
    return true;
  }

  void start() {
    base_ = held_.load();
    peak_ = base_.load();
  }

  [[nodiscard]] EmbreeContender::Memory since_start() const {
    return {difference(held_), difference(peak_)};
  }

 private:
  void add(std::int64_t bytes) {
    const std::int64_t now = held_.fetch_add(bytes) + bytes;
    std::int64_t peak = peak_.load();
    while (now > peak && !peak_.compare_exchange_weak(peak, now)) {
    }
  }

  [[nodiscard]] std::uint64_t difference(const std::atomic<std::int64_t>& value) const {
    return static_cast<std::uint64_t>(std::max<std::int64_t>(0, value.load() - base_.load()));
  }

  std::atomic<std::int64_t> held_{0};
  std::atomic<std::int64_t> peak_{0};
  std::atomic<std::int64_t> base_{0};
};

// Embree's manual asks for flush-to-zero and denormals-are-zero on every thread that traces. It
// sets them itself on a thread that starts it or builds, and leaves them so: what comes after must
// not be computed in that mode.
class FloatingPointMode {
 public:
#if defined(__x86_64__)
  FloatingPointMode() : before_(_mm_getcsr()) {
    constexpr unsigned flush_to_zero = 0x8000;
    constexpr unsigned denormals_are_zero = 0x0040;
    _mm_setcsr(before_ | flush_to_zero | denormals_are_zero);
  }
  ~FloatingPointMode() { _mm_setcsr(before_); }
#else
  FloatingPointMode() = default;
#endif
  FloatingPointMode(const FloatingPointMode&) = delete;             // tied to its thread
  FloatingPointMode& operator=(const FloatingPointMode&) = delete;  // likewise

 private:
  [[maybe_unused]] unsigned before_ = 0;
};

// One Embree device for all settings: its worker threads start once.
class Device {
 public:
  explicit Device(int threads) {
    [[maybe_unused]] const FloatingPointMode mode;
    const std::string config = "threads=" + std::to_string(threads) + ",set_affinity=0";
    device_ = rtcNewDevice(config.c_str());
    if (device_ == nullptr) {
      throw Error(ErrorCode::backend_unavailable, 0,
                  "Embree does not start (error " +
                      std::to_string(static_cast<int>(rtcGetDeviceError(nullptr))) + ")");
    }
    rtcSetDeviceMemoryMonitorFunction(device_, &MemoryAccount::report, &account_);
  }
  ~Device() { rtcReleaseDevice(device_); }
  Device(const Device&) = delete;             // one handle, one release
  Device& operator=(const Device&) = delete;  // likewise

  [[nodiscard]] RTCDevice get() const { return device_; }
  [[nodiscard]] MemoryAccount& account() { return account_; }

  [[nodiscard]] std::string version() const {
    const auto part = [&](RTCDeviceProperty property) {
      return std::to_string(rtcGetDeviceProperty(device_, property));
    };
    return part(RTC_DEVICE_PROPERTY_VERSION_MAJOR) + "." + part(RTC_DEVICE_PROPERTY_VERSION_MINOR) +
           "." + part(RTC_DEVICE_PROPERTY_VERSION_PATCH);
  }

  void require_no_error(const char* doing) const {
    const RTCError error = rtcGetDeviceError(device_);
    if (error == RTC_ERROR_NONE) return;
    throw Error(error == RTC_ERROR_OUT_OF_MEMORY ? ErrorCode::out_of_memory
                                                 : ErrorCode::backend_unavailable,
                static_cast<std::uint64_t>(error),
                std::string("Embree: ") + doing + " failed (error " +
                    std::to_string(static_cast<int>(error)) + ")");
  }

 private:
  MemoryAccount account_;
  RTCDevice device_ = nullptr;
};

// The calls that differ between Embree 3 and 4.
class Query {
 public:
  Query(RTCScene scene, bool coherent) : scene_(scene) {
#if ZKD_BENCH_EMBREE == 4
    rtcInitIntersectArguments(&intersect_);
    rtcInitOccludedArguments(&occluded_);
    intersect_.flags = coherent ? RTC_RAY_QUERY_FLAG_COHERENT : RTC_RAY_QUERY_FLAG_INCOHERENT;
    occluded_.flags = intersect_.flags;
  }
  void closest(RTCRayHit& ray) { rtcIntersect1(scene_, &ray, &intersect_); }
  void any(RTCRay& ray) { rtcOccluded1(scene_, &ray, &occluded_); }
  void closest(const int* valid, RTCRayHit8& rays) {
    rtcIntersect8(valid, scene_, &rays, &intersect_);
  }
  void any(const int* valid, RTCRay8& rays) { rtcOccluded8(valid, scene_, &rays, &occluded_); }

 private:
  RTCScene scene_;
  RTCIntersectArguments intersect_;
  RTCOccludedArguments occluded_;
#else
    rtcInitIntersectContext(&context_);
    context_.flags =
        coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  }
  void closest(RTCRayHit& ray) { rtcIntersect1(scene_, &context_, &ray); }
  void any(RTCRay& ray) { rtcOccluded1(scene_, &context_, &ray); }
  void closest(const int* valid, RTCRayHit8& rays) {
    rtcIntersect8(valid, scene_, &context_, &rays);
  }
  void any(const int* valid, RTCRay8& rays) { rtcOccluded8(valid, scene_, &context_, &rays); }

 private:
  RTCScene scene_;
  RTCIntersectContext context_;
#endif
};

// Primary rays and rays to one light stay together, bounces do not: Embree's packets want to know.
bool coherent(RayKind kind) { return kind != RayKind::diffuse; }

RTCRay one_ray(const Ray& ray) {
  RTCRay out;
  out.org_x = ray.origin.x;
  out.org_y = ray.origin.y;
  out.org_z = ray.origin.z;
  out.tnear = ray.t_min;
  out.dir_x = ray.direction.x;
  out.dir_y = ray.direction.y;
  out.dir_z = ray.direction.z;
  out.time = 0.0F;
  out.tfar = ray.t_max;
  out.mask = 0xFFFFFFFFu;
  out.id = 0;
  out.flags = 0;
  return out;
}

void set_ray(RTCRay8& out, std::size_t lane, const Ray& ray) {
  out.org_x[lane] = ray.origin.x;
  out.org_y[lane] = ray.origin.y;
  out.org_z[lane] = ray.origin.z;
  out.tnear[lane] = ray.t_min;
  out.dir_x[lane] = ray.direction.x;
  out.dir_y[lane] = ray.direction.y;
  out.dir_z[lane] = ray.direction.z;
  out.time[lane] = 0.0F;
  out.tfar[lane] = ray.t_max;
  out.mask[lane] = 0xFFFFFFFFu;
  out.id[lane] = 0;
  out.flags[lane] = 0;
}

// Embree marks an occluded ray by tfar = -infinity.
bool is_occluded(float tfar) { return tfar < 0.0F && std::isinf(tfar); }

void trace_closest(Query& query, std::span<const Ray> rays, std::span<Hit> hits) {
  for (std::size_t i = 0; i < rays.size(); ++i) {
    RTCRayHit one;
    one.ray = one_ray(rays[i]);
    one.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    one.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    query.closest(one);
    hits[i] = one.hit.geomID == RTC_INVALID_GEOMETRY_ID
                  ? Hit{}
                  : Hit{one.ray.tfar, one.hit.u, one.hit.v, one.hit.primID};
  }
}

void trace_any(Query& query, std::span<const Ray> rays, std::span<std::uint8_t> occluded) {
  for (std::size_t i = 0; i < rays.size(); ++i) {
    RTCRay one = one_ray(rays[i]);
    query.any(one);
    occluded[i] = is_occluded(one.tfar) ? 1 : 0;
  }
}

// Lanes of a packet that hold a ray; the last packet of a batch may be short.
struct Lanes {
  alignas(32) int valid[packet];
  std::size_t count;

  explicit Lanes(std::size_t rays_left) : count(std::min<std::size_t>(rays_left, packet)) {
    for (std::size_t lane = 0; lane < packet; ++lane) valid[lane] = lane < count ? -1 : 0;
  }
};

void trace_closest_packets(Query& query, std::span<const Ray> rays, std::span<Hit> hits) {
  for (std::size_t i = 0; i < rays.size(); i += packet) {
    const Lanes lanes(rays.size() - i);
    RTCRayHit8 eight;
    for (std::size_t lane = 0; lane < packet; ++lane) {
      set_ray(eight.ray, lane, rays[i + std::min(lane, lanes.count - 1)]);
      eight.hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;
      eight.hit.instID[0][lane] = RTC_INVALID_GEOMETRY_ID;
    }
    query.closest(lanes.valid, eight);
    for (std::size_t lane = 0; lane < lanes.count; ++lane) {
      hits[i + lane] = eight.hit.geomID[lane] == RTC_INVALID_GEOMETRY_ID
                           ? Hit{}
                           : Hit{eight.ray.tfar[lane], eight.hit.u[lane], eight.hit.v[lane],
                                 eight.hit.primID[lane]};
    }
  }
}

void trace_any_packets(Query& query, std::span<const Ray> rays, std::span<std::uint8_t> occluded) {
  for (std::size_t i = 0; i < rays.size(); i += packet) {
    const Lanes lanes(rays.size() - i);
    RTCRay8 eight;
    for (std::size_t lane = 0; lane < packet; ++lane) {
      set_ray(eight, lane, rays[i + std::min(lane, lanes.count - 1)]);
    }
    query.any(lanes.valid, eight);
    for (std::size_t lane = 0; lane < lanes.count; ++lane) {
      occluded[i + lane] = is_occluded(eight.tfar[lane]) ? 1 : 0;
    }
  }
}

// Hands the rays out to as many threads as zkd has, in batches.
template <class Answer, class TraceBatch>
void for_each_batch(int threads, RTCScene scene, bool stay_together, std::span<const Ray> rays,
                    std::span<Answer> answers, TraceBatch trace_batch) {
  const std::int64_t batches = (static_cast<std::int64_t>(rays.size()) + batch - 1) / batch;
#pragma omp parallel num_threads(threads)
  {
    [[maybe_unused]] const FloatingPointMode mode;
    Query query(scene, stay_together);
#pragma omp for schedule(dynamic)
    for (std::int64_t i = 0; i < batches; ++i) {
      const std::size_t begin = static_cast<std::size_t>(i) * batch;
      const std::size_t count = std::min<std::size_t>(batch, rays.size() - begin);
      trace_batch(query, rays.subspan(begin, count), answers.subspan(begin, count));
    }
  }
}

struct Preset {
  RTCBuildQuality quality;
  const char* name;
  bool robust;
};

constexpr std::array<Preset, 6> presets{{{RTC_BUILD_QUALITY_LOW, "low", false},
                                         {RTC_BUILD_QUALITY_LOW, "low robust", true},
                                         {RTC_BUILD_QUALITY_MEDIUM, "medium", false},
                                         {RTC_BUILD_QUALITY_MEDIUM, "medium robust", true},
                                         {RTC_BUILD_QUALITY_HIGH, "high", false},
                                         {RTC_BUILD_QUALITY_HIGH, "high robust", true}}};

class Embree final : public EmbreeContender {
 public:
  Embree(std::shared_ptr<Device> device, std::shared_ptr<const PaddedMesh> mesh, Preset preset,
         int threads)
      : device_(std::move(device)), mesh_(std::move(mesh)), preset_(preset), threads_(threads) {}
  ~Embree() override { release(); }
  Embree(const Embree&) = delete;             // one handle, one release
  Embree& operator=(const Embree&) = delete;  // likewise

  [[nodiscard]] std::vector<std::string> names() const override {
    const std::string name = "embree-" + device_->version() + " " + preset_.name;
    return {name, name + " packet8"};
  }

  double build() override {
    release();
    [[maybe_unused]] const FloatingPointMode mode;
    device_->account().start();
    const Stopwatch watch;
    scene_ = rtcNewScene(device_->get());
    rtcSetSceneBuildQuality(scene_, preset_.quality);
    rtcSetSceneFlags(scene_, preset_.robust ? RTC_SCENE_FLAG_ROBUST : RTC_SCENE_FLAG_NONE);
    const RTCGeometry geometry = rtcNewGeometry(device_->get(), RTC_GEOMETRY_TYPE_TRIANGLE);
    // The Morton builder runs only where scene and geometry both ask for LOW.
    rtcSetGeometryBuildQuality(geometry, preset_.quality);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                               mesh_->positions.data(), 0, sizeof(glm::vec3),
                               mesh_->position_count);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                               mesh_->faces.data(), 0, sizeof(glm::uvec3), mesh_->faces.size());
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene_);
    const double ms = watch.ms();
    memory_ = device_->account().since_start();
    device_->require_no_error("building");
    return ms;
  }

  Timing trace(std::size_t way, RayKind kind, std::span<const Ray> rays) override {
    const bool packets = way == 1;
    Timing timing;
    if (kind == RayKind::shadow) {
      occluded_.resize(rays.size());
      const Stopwatch watch;
      for_each_batch<std::uint8_t>(threads_, scene_, coherent(kind), rays, occluded_,
                                   packets ? trace_any_packets : trace_any);
      timing.ms = watch.ms();
      timing.hits = static_cast<std::uint64_t>(
          std::count(occluded_.begin(), occluded_.end(), std::uint8_t{1}));
    } else {
      hits_.resize(rays.size());
      const Stopwatch watch;
      for_each_batch<Hit>(threads_, scene_, coherent(kind), rays, hits_,
                          packets ? trace_closest_packets : trace_closest);
      timing.ms = watch.ms();
      timing.hits = static_cast<std::uint64_t>(std::count_if(
          hits_.begin(), hits_.end(), [](const Hit& hit) { return hit.triangle != no_triangle; }));
    }
    device_->require_no_error("tracing");
    return timing;
  }

  void closest_hit(std::span<const Ray> rays, std::span<Hit> hits) override {
    for_each_batch<Hit>(threads_, scene_, false, rays, hits, trace_closest);
    device_->require_no_error("tracing");
  }

  void clear() override { release(); }

  [[nodiscard]] Memory memory() const override { return memory_; }

 private:
  void release() {
    if (scene_ != nullptr) rtcReleaseScene(scene_);
    scene_ = nullptr;
  }

  std::shared_ptr<Device> device_;
  std::shared_ptr<const PaddedMesh> mesh_;
  Preset preset_;
  int threads_;
  RTCScene scene_ = nullptr;
  Memory memory_;
  std::vector<Hit> hits_;
  std::vector<std::uint8_t> occluded_;
};

}  // namespace

std::vector<std::unique_ptr<EmbreeContender>> embree_contenders(const scene::Mesh& mesh,
                                                                int threads) {
  const auto device = std::make_shared<Device>(threads);
  const auto padded = std::make_shared<const PaddedMesh>(mesh);
  std::vector<std::unique_ptr<EmbreeContender>> contenders;
  for (const Preset& preset : presets) {
    contenders.push_back(std::make_unique<Embree>(device, padded, preset, threads));
  }
  return contenders;
}

}  // namespace zkd::bench
