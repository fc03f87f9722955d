// SPDX-License-Identifier: Apache-2.0
//
// Answers against exact arithmetic: nothing missed, invented or taken for another triangle outside
// the error band. What lies in the band is counted and printed. Embree, where it was found, is a
// second opinion: each disagreement is put before the oracle.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <map>
#include <string>
#include <vector>

#if defined(ZKD_TEST_EMBREE)
#if ZKD_TEST_EMBREE == 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif
#endif

#include <zkd/zkd.hpp>

#include "scene/generate.hpp"
#include "scene/load.hpp"
#include "support/hits.hpp"
#include "support/meshes.hpp"
#include "support/platform_tree.hpp"
#include "support/rays.hpp"
#include "verify/band.hpp"
#include "verify/check.hpp"
#include "verify/oracle.hpp"

namespace zkd {
namespace {

using test::print;

BuildOptions options_for(References references) {
  BuildOptions options;
  options.references = references;
  options.invalid_triangles = InvalidTriangles::skip;
  return options;
}

std::vector<Ray> rays_for(const test::NamedMesh& m, const test::PlatformTree& tree,
                          std::uint32_t count, std::uint64_t seed) {
  return scene::hard_rays(m.mesh, tree.host().view(), count, seed);
}

void report(const std::string& name, const verify::Summary& total) {
  std::printf("%-36s rays %8llu, in the band: missed %llu, phantom %llu, wrong triangle %llu\n",
              name.c_str(), static_cast<unsigned long long>(total.rays),
              static_cast<unsigned long long>(total.in_band.missed),
              static_cast<unsigned long long>(total.in_band.phantom),
              static_cast<unsigned long long>(total.in_band.wrong_triangle));
  testing::Test::RecordProperty("rays", std::to_string(total.rays));
  testing::Test::RecordProperty("in_band_missed", std::to_string(total.in_band.missed));
  testing::Test::RecordProperty("in_band_phantom", std::to_string(total.in_band.phantom));
  testing::Test::RecordProperty("in_band_wrong", std::to_string(total.in_band.wrong_triangle));
}

void expect_none_outside_band(const verify::Summary& one, const verify::Oracle& oracle,
                              const test::NamedMesh& m, const std::vector<Ray>& rays,
                              const std::vector<Hit>& hits) {
  EXPECT_EQ(one.outside_band(), 0u)
      << m.name << ": missed " << one.missed << ", phantom " << one.phantom << ", wrong "
      << one.wrong_triangle << ", in the band " << one.in_band.total();
  for (const std::uint64_t i : one.first_offenders) {
    const verify::ExactHit exact = oracle.closest_hit(rays[i]);
    ADD_FAILURE() << m.name << ", ray " << i << " " << print(rays[i]) << ": "
                  << verify::to_string(verify::judge(oracle, m.mesh.view(), rays[i], hits[i]).kind)
                  << ", " << print(hits[i]) << ", exactly t " << exact.t << " in "
                  << exact.ties.size() << " triangles, the first "
                  << (exact.ties.empty() ? no_triangle : exact.ties[0]);
  }
}

class QueryOracle : public testing::TestWithParam<test::MeshKind> {};

TEST_P(QueryOracle, NothingOutsideTheBand) {
  std::map<Intersector, verify::Summary> totals;
  std::string name;
  for (std::uint64_t seed = 100; seed < 102; ++seed) {
    const test::NamedMesh m = test::small_mesh(GetParam().number, seed);
    name = m.name;
    const verify::Oracle oracle(m.mesh.view());
    for (const References references : {References::once, References::all}) {
      const test::PlatformTree tree(m.mesh.view(), options_for(references));
      const std::vector<Ray> rays = rays_for(m, tree, 360, seed);
      for (const Intersector intersector : test::intersectors()) {
        SCOPED_TRACE("seed " + std::to_string(seed) + ", " + to_string(references) + ", " +
                     to_string(intersector));
        const std::vector<Hit> hits =
            tree.closest_hits(rays, test::Walk::automatic, nullptr, intersector);
        const verify::Summary one =
            verify::check(oracle, m.mesh.view(), rays, hits, 2, {}, intersector);
        totals[intersector].add_counts(one);
        expect_none_outside_band(one, oracle, m, rays, hits);
        if (intersector == Intersector::exact) {
          EXPECT_EQ(one.correct, one.rays);
          EXPECT_LE(one.t_ulp_max, 0.5000001);
        }
        if (testing::Test::HasFailure()) return;
      }
    }
  }
  for (const auto& [intersector, total] : totals)
    report(name + ", " + to_string(intersector), total);
}

#if defined(ZKD_TEST_EMBREE)

// Embree ROBUST over the valid triangles of a mesh.
class Embree {
 public:
  explicit Embree(const scene::Mesh& mesh) : device_(rtcNewDevice("threads=2")) {
    scene_ = rtcNewScene(device_);
    rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
    RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertices = static_cast<float*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                sizeof(glm::vec3), mesh.positions.size()));
    auto* indices = static_cast<unsigned*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                sizeof(glm::uvec3), mesh.faces.size()));
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
      for (int a = 0; a < 3; ++a) *vertices++ = mesh.positions[i][a];
    }
    for (const glm::uvec3& face : mesh.faces) {
      for (int c = 0; c < 3; ++c) *indices++ = face[c];
    }
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene_);
  }
  ~Embree() {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }
  Embree(const Embree&) = delete;
  Embree& operator=(const Embree&) = delete;

  [[nodiscard]] Hit closest(const Ray& ray) const {
    RTCRayHit query{};
    query.ray.org_x = ray.origin.x;
    query.ray.org_y = ray.origin.y;
    query.ray.org_z = ray.origin.z;
    query.ray.dir_x = ray.direction.x;
    query.ray.dir_y = ray.direction.y;
    query.ray.dir_z = ray.direction.z;
    query.ray.tnear = ray.t_min;
    query.ray.tfar = ray.t_max;
    query.ray.mask = 0xFFFFFFFFu;
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
#if ZKD_TEST_EMBREE == 4
    rtcIntersect1(scene_, &query);
#else
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(scene_, &context, &query);
#endif
    if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return {};
    return {query.ray.tfar, query.hit.u, query.hit.v, query.hit.primID};
  }

 private:
  RTCDevice device_;
  RTCScene scene_ = nullptr;
};

// Embree has no rule for degenerate rays, and asserts that numbers stay below 1.844e18.
bool taken_by_embree(const Ray& ray) {
  if (verify::degenerate(ray) || ray.t_min < 0.0F) return false;
  for (int a = 0; a < 3; ++a) {
    if (std::abs(ray.origin[a]) > 1e18F || std::abs(ray.direction[a]) > 1e18F) return false;
  }
  return true;
}

struct Disagreements {
  std::uint64_t rays = 0;
  std::uint64_t all = 0;           // another triangle, or hit against miss
  std::uint64_t embree_wrong = 0;  // outside the band
  std::uint64_t zkd_in_band = 0;
  std::uint64_t zkd_wrong = 0;  // outside the band: the target is 0
};

Disagreements compare(const test::NamedMesh& m, const std::vector<Ray>& rays,
                      const std::vector<Hit>& hits) {
  const verify::Oracle oracle(m.mesh.view());
  const Embree embree(m.mesh);
  Disagreements d;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (!taken_by_embree(rays[i])) continue;
    ++d.rays;
    const Hit other = embree.closest(rays[i]);
    if (other.triangle == hits[i].triangle) continue;
    ++d.all;
    const verify::Verdict ours = verify::judge(oracle, m.mesh.view(), rays[i], hits[i]);
    const verify::Verdict theirs =
        verify::judge(oracle, m.mesh.view(), rays[i], other, Intersector::single_precision);
    if (theirs.kind != verify::Verdict::correct && !theirs.in_band) ++d.embree_wrong;
    if (ours.kind == verify::Verdict::correct) continue;
    if (ours.in_band) {
      ++d.zkd_in_band;
    } else if (d.zkd_wrong++ < 5) {
      ADD_FAILURE() << m.name << ": " << verify::to_string(ours.kind) << ", " << print(hits[i])
                    << ", Embree " << print(other) << ", " << print(rays[i]);
    }
  }
  std::printf(
      "%-24s rays %8llu, disagreements with Embree %llu; outside the band: Embree %llu, "
      "zkd %llu; zkd in the band %llu\n",
      m.name.c_str(), static_cast<unsigned long long>(d.rays),
      static_cast<unsigned long long>(d.all), static_cast<unsigned long long>(d.embree_wrong),
      static_cast<unsigned long long>(d.zkd_wrong), static_cast<unsigned long long>(d.zkd_in_band));
  testing::Test::RecordProperty("disagreements", std::to_string(d.all));
  testing::Test::RecordProperty("embree_wrong", std::to_string(d.embree_wrong));
  testing::Test::RecordProperty("zkd_in_band", std::to_string(d.zkd_in_band));
  return d;
}

TEST_P(QueryOracle, EmbreeRobustDisagreesOnlyWhereItIsWrongOrInTheBand) {
  const test::NamedMesh m = test::small_mesh(GetParam().number, 110);
  const test::PlatformTree tree(m.mesh.view(), options_for(References::once));
  const std::vector<Ray> rays = rays_for(m, tree, 1000, 110);
  const Disagreements d = compare(m, rays, tree.closest_hits(rays));
  EXPECT_EQ(d.zkd_wrong, 0u);
}

#endif  // ZKD_TEST_EMBREE

INSTANTIATE_TEST_SUITE_P(Every, QueryOracle, testing::ValuesIn(test::every_mesh_kind()),
                         [](const auto& kind) { return kind.param.name(); });

// ---- A real mesh --------------------------------------------------------------------------------

// A picture's worth of rays from a corner in front of the box.
std::vector<Ray> primary_rays(const Box& box, int size) {
  const glm::vec3 lo = {box.lo[0], box.lo[1], box.lo[2]};
  const glm::vec3 hi = {box.hi[0], box.hi[1], box.hi[2]};
  const glm::vec3 centre = 0.5F * (lo + hi);
  const glm::vec3 half = 0.5F * (hi - lo);
  const glm::vec3 eye = centre + glm::vec3(0.9F, 0.6F, 3.0F) * half;
  std::vector<Ray> rays;
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      const float u = 2.0F * (static_cast<float>(x) + 0.5F) / static_cast<float>(size) - 1.0F;
      const float v = 2.0F * (static_cast<float>(y) + 0.5F) / static_cast<float>(size) - 1.0F;
      Ray ray;
      ray.origin = eye;
      ray.direction = centre + glm::vec3(u * half.x, v * half.y, 0.0F) - eye;
      rays.push_back(ray);
    }
  }
  return rays;
}

TEST(QueryOracleBunny, NothingOutsideTheBand) {
  const std::filesystem::path file = "/usr/share/glmark2/models/bunny.obj";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << "package glmark2-data is not installed";
  const test::NamedMesh m{"Bunny", scene::load_mesh(file)};
  ASSERT_GT(m.mesh.faces.size(), 60000u);
  const verify::Oracle oracle(m.mesh.view());
  verify::Summary total;
  for (const References references : {References::once, References::all}) {
    const test::PlatformTree tree(m.mesh.view(), options_for(references));
    std::vector<Ray> rays = primary_rays(tree.host().view().bounds(), 128);
    const std::vector<Ray> hard = rays_for(m, tree, 4000, 120);
    rays.insert(rays.end(), hard.begin(), hard.end());
    const std::vector<Hit> hits = tree.closest_hits(rays);
    const verify::Summary one = verify::check(oracle, m.mesh.view(), rays, hits, 2);
    total.add_counts(one);
    expect_none_outside_band(one, oracle, m, rays, hits);
#if defined(ZKD_TEST_EMBREE)
    if (references == References::once) {
      EXPECT_EQ(compare(m, rays, hits).zkd_wrong, 0u);
    }
#endif
  }
  report(m.name, total);
}

}  // namespace
}  // namespace zkd
