#pragma once
#include <string>

#include "relax/envelope.hpp"

namespace heddle {

/// Yarns as a TG3 file of TexGen (https://github.com/louisepb/TexGen), in millimeters: for each yarn a master node at the centroid of every
/// section, with the section's plane across the node's tangent and its outline as a polygon, onto which points are projected that were
/// moved off it where yarns touch; the two periods of the cell as its repeats; and the cell, as high as the yarns, as the domain. Between
/// sections TexGen interpolates by splines of its own. `name` is the textile's. Throws std::invalid_argument for no yarns.
std::string texgen_text(const relax::Envelopes& envelopes, const std::string& name);

}  // namespace heddle
