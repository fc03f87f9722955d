// SPDX-License-Identifier: Apache-2.0
//
// PLY and STL read once more by Assimp. Its numbers from text may be an ulp off, and it reads on
// where a file contradicts its header: what it read is only compared.
#include <algorithm>

#include "scene/assimp_reader.hpp"
#include "scene/second_reader.hpp"

namespace zkd::scene {
namespace {

[[noreturn]] void disagree(const SourceFile& file, const std::string& where) {
  file.fail("Assimp and zkd read " + where + " differently; the file is not trusted");
}

}  // namespace

void compare_ply_with_assimp(const SourceFile& file, const Reading& reading) {
  Assimp::Importer importer;
  const aiScene& scene = read_with_assimp(importer, file);
  if (scene.mNumMeshes != 1) disagree(file, "the number of meshes");
  const aiMesh& read = *scene.mMeshes[0];
  const std::vector<glm::vec3>& positions = reading.mesh.positions;
  if (read.mNumVertices != positions.size()) disagree(file, "the number of vertices");
  for (unsigned i = 0; i < read.mNumVertices; ++i) {
    const aiVector3D& p = read.mVertices[i];
    if (!nearly_equal(positions[i], p.x, p.y, p.z)) disagree(file, "vertex " + std::to_string(i));
  }
  Outline seen;
  for (unsigned i = 0; i < read.mNumFaces; ++i) {
    const aiFace& face = read.mFaces[i];
    seen.begin_polygon(face.mNumIndices);
    for (unsigned k = 0; k < face.mNumIndices; ++k) seen.corner(face.mIndices[k]);
  }
  if (seen != reading.outline) disagree(file, "the faces");
}

void compare_stl_with_assimp(const SourceFile& file, const Mesh& mesh) {
  Assimp::Importer importer;
  const aiScene& scene = read_with_assimp(importer, file);
  std::size_t corner = 0;
  for (unsigned m = 0; m < scene.mNumMeshes; ++m) {
    const aiMesh& part = *scene.mMeshes[m];
    for (unsigned f = 0; f < part.mNumFaces; ++f) {
      const aiFace& face = part.mFaces[f];
      if (face.mNumIndices != 3) disagree(file, "triangle " + std::to_string(corner / 3));
      for (unsigned k = 0; k < 3; ++k, ++corner) {
        const unsigned index = face.mIndices[k];
        if (corner >= mesh.positions.size() || index >= part.mNumVertices ||
            !nearly_equal(mesh.positions[corner], part.mVertices[index].x, part.mVertices[index].y,
                          part.mVertices[index].z)) {
          disagree(file, "triangle " + std::to_string(corner / 3));
        }
      }
    }
  }
  if (corner != mesh.positions.size()) disagree(file, "the number of triangles");
}

}  // namespace zkd::scene
