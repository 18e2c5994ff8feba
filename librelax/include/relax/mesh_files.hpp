#pragma once
#include <string>

#include "relax/composite.hpp"
#include "relax/volume_mesh.hpp"

namespace relax {

/// VTK's XML file of an unstructured grid (.vtu, appended raw binary), in meters. Cell arrays by the names and conventions of TexGen's
/// voxel files (L. P. Brown and A. C. Long, 2021): YarnIndex (index into mesh.yarns, -1 matrix), YarnTangent, Location, VolumeFraction,
/// SurfaceDistance (negative inside the yarn), Orientation (fiber direction); what has no meaning in matrix is 0 there. Beside them Yarn,
/// the number of the yarn in weave::Snapshot, -1 matrix.
std::string vtu_text(const VolumeMesh& mesh);

/// Gmsh's MSH 4.1 format (ASCII), in meters: a physical volume MATRIX and one for each yarn, YARN_n, n as in weave::Snapshot.
std::string gmsh_text(const VolumeMesh& mesh);

}  // namespace relax
