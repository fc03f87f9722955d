// SPDX-License-Identifier: Apache-2.0
//
// Rows 33 to 40 and 46 to 48: rays at features, along axes, in planes, from afar, grazing.
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "scene/generate.hpp"
#include "scene/hard_meshes.hpp"
#include "scene/hard_rays.hpp"
#include "scene/random.hpp"
#include "stress/case.hpp"

namespace zkd::stress {
namespace {

using scene::Mesh;
using scene::Random;
using scene::ray_between;
using scene::RayMaker;

std::vector<BuildOptions> some_options(const Setting& setting) {
  return setting.size == Size::small ? many_options() : once_and_all();
}

// Rays made one by one.
RaySource each(const std::function<Ray(RayMaker&)>& make) {
  return [make](const Mesh& mesh, const TreeView& tree, std::uint32_t count, std::uint64_t seed) {
    RayMaker maker(mesh, tree, seed);
    std::vector<Ray> rays;
    for (std::uint32_t i = 0; i < count; ++i) rays.push_back(make(maker));
    return rays;
  };
}

// The same rays at meshes of several kinds.
void at_meshes(const Setting& setting, const Yield& yield,
               const std::function<Ray(RayMaker&)>& make, std::uint32_t small_count,
               std::uint32_t large_count) {
  const std::uint32_t count = setting.pick(300u, 20000u);
  std::vector<scene::NamedMesh> meshes;
  meshes.push_back({"soup", scene::soup(count, setting.seed)});
  meshes.push_back({"sphere", scene::sphere(setting.pick(2u, 5u))});
  meshes.push_back({"grid", scene::grid(setting.pick(3u, 16u))});
  meshes.push_back({"integers", scene::integer_mesh(count / 4, 4, setting.seed)});
  meshes.push_back({"slivers", scene::slivers(count, 1e5F, setting.seed)});
  meshes.push_back(
      {"far soup", scene::offset(scene::soup(count, setting.seed), {148376, 1e6F, 0})});
  for (scene::NamedMesh& mesh : meshes) {
    Case made = hard_case(mesh.name, std::move(mesh.mesh), some_options(setting),
                          setting.pick(small_count, large_count));
    made.rays = each(make);
    made.oracle_rays = setting.pick(0u, 3000u);
    yield(std::move(made));
  }
}

// ---- 33 to 35: leaks ----------------------------------------------------------------------------

// Closed surfaces that wind once round a ball about `centre`, of radius `clear`.
struct Closed {
  std::string name;
  Mesh mesh;
  glm::vec3 centre;
  float clear;
};

std::vector<Closed> closed_surfaces(const Setting& setting) {
  const std::uint32_t finest = setting.pick(3u, 6u);
  std::vector<Closed> all;
  for (std::uint32_t subdivisions = 0; subdivisions <= finest; ++subdivisions) {
    all.push_back({"sphere " + std::to_string(subdivisions), scene::sphere(subdivisions),
                   glm::vec3(0), 0.25F});
  }
  all.push_back({"crumpled sphere", scene::jittered(scene::sphere(finest), 8, setting.seed),
                 glm::vec3(0), 0.25F});
  Mesh flat = scene::sphere(finest);
  for (glm::vec3& p : flat.positions) p.z *= 0x1p-10F;
  all.push_back({"flattened sphere", std::move(flat), glm::vec3(0), 0x1p-13F});
  for (const float by : {100.0F, 148376.0F, 1e6F}) {
    const glm::vec3 centre = {by, -by, 0.5F * by};
    all.push_back({"sphere at " + std::to_string(by),
                   scene::offset(scene::scaled(scene::sphere(finest), 3), centre), centre, 1.0F});
  }
  all.push_back(
      {"tiny sphere", scene::scaled(scene::sphere(finest), -110), glm::vec3(0), 0x1p-112F});
  all.push_back(
      {"huge sphere", scene::scaled(scene::sphere(finest), 120), glm::vec3(0), 0x1p+118F});
  return all;
}

void from_inside(const Setting& setting, const Yield& yield,
                 const std::function<glm::vec3(RayMaker&)>& target) {
  for (Closed& surface : closed_surfaces(setting)) {
    Case made = hard_case(surface.name, std::move(surface.mesh), once_and_all(),
                          setting.pick(2000u, 60000u));
    made.hits = Case::Hits::all;
    made.oracle_rays = setting.pick(0u, 3000u);
    made.rays = each([target, centre = surface.centre, clear = surface.clear](RayMaker& maker) {
      const glm::vec3 from = centre + clear * 0.5F * maker.random().in_cube();
      return ray_between(from, target(maker));
    });
    yield(std::move(made));
  }
}

void to_vertices(const Setting& setting, const Yield& yield) {
  from_inside(setting, yield, [](RayMaker& maker) { return maker.vertex(); });
}
void to_edges(const Setting& setting, const Yield& yield) {
  from_inside(setting, yield, [](RayMaker& maker) { return maker.on_edge(); });
}
void to_targets_beside(const Setting& setting, const Yield& yield) {
  from_inside(setting, yield, [](RayMaker& maker) {
    return maker.moved(maker.random().one_in(2) ? maker.vertex() : maker.on_edge(), 8);
  });
}

// ---- 36 to 40 -----------------------------------------------------------------------------------

void along_axes(const Setting& setting, const Yield& yield) {
  at_meshes(
      setting, yield, [](RayMaker& maker) { return maker.along_axis(maker.vertex()); }, 900, 40000);
}

void along_axes_beside(const Setting& setting, const Yield& yield) {
  at_meshes(
      setting, yield,
      [](RayMaker& maker) {
        glm::vec3 through = maker.vertex();
        const int axis = maker.random().integer(0, 2);
        through[axis] = scene::ulps(through[axis], maker.random().one_in(2) ? 1 : -1);
        if (maker.random().one_in(2)) through = maker.moved(through, 1);
        return maker.along_axis(through);
      },
      900, 40000);
}

void in_split_planes(const Setting& setting, const Yield& yield) {
  at_meshes(
      setting, yield, [](RayMaker& maker) { return maker.in_plane(); }, 900, 40000);
}

void through_cell_corners(const Setting& setting, const Yield& yield) {
  at_meshes(
      setting, yield,
      [](RayMaker& maker) {
        const glm::vec3 to = maker.cell_corner();
        return ray_between(maker.random().one_in(4) ? maker.cell_corner() : maker.around(), to);
      },
      900, 40000);
}

void near_parallel(const Setting& setting, const Yield& yield) {
  at_meshes(
      setting, yield, [](RayMaker& maker) { return maker.nearly_parallel(); }, 900, 40000);
}

// ---- 46 -----------------------------------------------------------------------------------------

// The line of a ray, from an origin that is near `at`.
Ray from_nearby(const Ray& far, const glm::vec3& at, float distance) {
  double along = 0.0;
  double square = 0.0;
  for (int a = 0; a < 3; ++a) {
    const double d = far.direction[a];
    along += d * (double{at[a]} - far.origin[a]);
    square += d * d;
  }
  const double s = along / square - distance / std::sqrt(square);
  Ray near = far;
  for (int a = 0; a < 3; ++a) {
    near.origin[a] = static_cast<float>(double{far.origin[a]} + s * far.direction[a]);
  }
  return near;
}

// Far rays and the same from nearby, in turn.
std::vector<Ray> far_and_near(const Mesh& mesh, const TreeView& tree, std::uint32_t count,
                              std::uint64_t seed) {
  RayMaker maker(mesh, tree, seed);
  const Box box = tree.bounds();
  const glm::vec3 centre = {0.5F * (box.lo[0] + box.hi[0]), 0.5F * (box.lo[1] + box.hi[1]),
                            0.5F * (box.lo[2] + box.hi[2])};
  std::vector<Ray> rays;
  for (std::uint32_t i = 0; i + 1 < count; i += 2) {
    const Ray far = maker.from_afar();
    rays.push_back(far);
    rays.push_back(from_nearby(far, centre, 4.0F * maker.size()));
  }
  return rays;
}

void from_afar(const Setting& setting, const Yield& yield) {
  const std::uint32_t count = setting.pick(400u, 30000u);
  std::vector<scene::NamedMesh> meshes;
  meshes.push_back({"soup", scene::soup(count, setting.seed)});
  meshes.push_back({"sphere", scene::sphere(setting.pick(3u, 6u))});
  meshes.push_back({"far soup", scene::offset(scene::soup(count, setting.seed), {1000, -500, 0})});
  for (scene::NamedMesh& mesh : meshes) {
    Case made =
        hard_case(mesh.name, std::move(mesh.mesh), once_and_all(), setting.pick(4000u, 30000u));
    made.rays = far_and_near;
    made.oracle_rays = setting.pick(0u, 3000u);
    made.also = [](const Traced& traced, Findings& findings) {
      std::uint64_t far = 0;
      std::uint64_t near = 0;
      for (std::size_t i = 0; i + 1 < traced.rays.size(); i += 2) {
        far += traced.costs[i].node_visits;
        near += traced.costs[i + 1].node_visits;
      }
      findings.expect(near > 0, "no ray meets the scene");
      // The origins nearby are rounded, so the lines are not quite the same.
      findings.expect(static_cast<double>(far) <= 1.02 * static_cast<double>(near),
                      "from afar " + std::to_string(far) + " nodes are visited, from nearby " +
                          std::to_string(near));
    };
    yield(std::move(made));
  }
}

// ---- 47, 48 -------------------------------------------------------------------------------------

// At a point of a face, `tangent` above its plane.
Ray grazing_ray(const Mesh& mesh, RayMaker& maker, float most_tangent) {
  Random& random = maker.random();
  for (;;) {
    const glm::uvec3& face =
        mesh.faces[random.below(static_cast<std::uint32_t>(mesh.faces.size()))];
    const glm::vec3& a = mesh.positions[face.x];
    const glm::vec3 e = mesh.positions[face.y] - a;
    const glm::vec3 f = mesh.positions[face.z] - a;
    const glm::vec3 normal = glm::cross(e, f);
    const float area = std::sqrt(glm::dot(normal, normal));
    if (!(area > 0.0F)) continue;
    const float u = random.unit();
    const glm::vec3 at = a + u * e + (1.0F - u) * random.unit() * f;
    const glm::vec3 along = random.signed_unit() * e + random.signed_unit() * f;
    const float length = std::sqrt(glm::dot(along, along));
    const float rise = length * most_tangent * random.unit() * (random.one_in(2) ? 1.0F : -1.0F);
    const glm::vec3 direction = along + (rise / area) * normal;
    return {at - (1.0F + random.unit()) * direction, 0.0F, direction};
  }
}

void grazing(const Setting& setting, const Yield& yield) {
  for (const float tangent : {0.0087F, 1.7e-5F, 1e-7F}) {  // of 0.5 and 0.001 degrees, and less
    std::vector<scene::NamedMesh> meshes;
    meshes.push_back({"soup", scene::soup(setting.pick(300u, 20000u), setting.seed)});
    meshes.push_back({"sphere", scene::sphere(setting.pick(3u, 6u))});
    meshes.push_back({"grid", scene::grid(setting.pick(3u, 12u))});
    meshes.push_back({"slivers", scene::slivers(setting.pick(300u, 20000u), 1e3F, setting.seed)});
    for (scene::NamedMesh& mesh : meshes) {
      Case made =
          hard_case(mesh.name + ", tangent " + std::to_string(tangent), std::move(mesh.mesh),
                    some_options(setting), setting.pick(1200u, 20000u));
      made.oracle_rays = setting.pick(0u, 3000u);
      made.rays = [tangent](const Mesh& of, const TreeView& tree, std::uint32_t count,
                            std::uint64_t seed) {
        RayMaker maker(of, tree, seed);
        std::vector<Ray> rays;
        for (std::uint32_t i = 0; i < count; ++i) rays.push_back(grazing_ray(of, maker, tangent));
        return rays;
      };
      yield(std::move(made));
    }
  }
}

// A plane through whole points, tiled by triangles with whole corners, and rays within it. In the
// first three kinds the plane is parallel to an axis and nothing is rounded: no intersector may
// hit. In oblique planes a sheared corner is rounded, and a hit is in the band. No filter decides
// here: every triangle on the way is exact arithmetic's, so the plane is not large and the oracle
// sees some of its rays.
void exactly_coplanar(const Setting& setting, const Yield& yield) {
  for (std::uint64_t i = 0; i < setting.pick(8u, 24u); ++i) {
    Random random(1000 * setting.seed + i);
    const auto whole = [](Random& dice, int most) {
      const auto x = static_cast<float>(dice.integer(-most, most));
      const auto y = static_cast<float>(dice.integer(-most, most));
      const auto z = static_cast<float>(dice.integer(-most, most));
      return glm::vec3(x, y, z);
    };
    glm::vec3 e{0.0F};
    glm::vec3 f{0.0F};
    while (glm::cross(e, f) == glm::vec3(0.0F)) {
      e = whole(random, 3);
      f = whole(random, 3);
      if (i % 4 < 3) e[static_cast<int>(i % 4)] = f[static_cast<int>(i % 4)] = 0.0F;
    }
    const glm::vec3 base = whole(random, 100);
    const int side = setting.pick(8, 40);
    const auto at = [=](int x, int y) {
      return base + static_cast<float>(x) * e + static_cast<float>(y) * f;
    };
    Mesh mesh;
    for (int y = 0; y < side; ++y) {
      for (int x = 0; x < side; ++x) {
        const auto first = static_cast<std::uint32_t>(mesh.positions.size());
        mesh.positions.insert(mesh.positions.end(),
                              {at(x, y), at(x + 1, y), at(x, y + 1), at(x + 1, y + 1)});
        mesh.faces.emplace_back(first, first + 1, first + 2);
        mesh.faces.emplace_back(first + 2, first + 1, first + 3);
      }
    }
    Case made = hard_case("plane " + std::to_string(i), std::move(mesh), some_options(setting),
                          setting.pick(600u, 10000u));
    made.oracle_rays = setting.pick(0u, 1000u);
    if (i % 4 < 3) made.hits = Case::Hits::none;
    made.rays = [=](const Mesh&, const TreeView&, std::uint32_t count, std::uint64_t seed) {
      Random dice(seed);
      std::vector<Ray> rays;
      while (rays.size() < count) {
        const glm::vec3 from = at(dice.integer(-4, side + 4), dice.integer(-4, side + 4));
        const glm::vec3 to = at(dice.integer(0, side), dice.integer(0, side));
        if (from != to) rays.push_back(ray_between(from, to));
      }
      return rays;
    };
    yield(std::move(made));
  }
}

}  // namespace

std::vector<Row> ray_rows() {
  return {{33, "from inside to vertices", to_vertices},
          {34, "from inside to edges", to_edges},
          {35, "from inside to targets +-8 ulp", to_targets_beside},
          {36, "axis-parallel through vertices", along_axes},
          {37, "axis-parallel, off by 1 ulp", along_axes_beside},
          {38, "in a split plane", in_split_planes},
          {39, "through cell corners", through_cell_corners},
          {40, "near-parallel", near_parallel},
          {46, "origin at 10^7 x the extent", from_afar},
          {47, "grazing", grazing},
          {48, "exactly coplanar", exactly_coplanar}};
}

}  // namespace zkd::stress
