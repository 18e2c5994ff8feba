#pragma once
#include <cstdint>
#include <vector>

#include "relax/cell.hpp"
#include "relax/sparse_hessian.hpp"

namespace relax {

/// What is wanted of an energy term beside its value; each is added to, not set.
struct Derivatives {
  Eigen::VectorXd* gradient = nullptr;  ///< (unknowns) [N]
  SparseHessian* hessian = nullptr;     ///< [N/m]
  bool convex = false;      ///< leave out of the Hessian what makes it indefinite: pushed bars' turning, the turning of contact normals
  bool fiber_wise = false;  ///< leave out of the Hessian what couples different fibers in contact
};

/// Places where the line contact of two fibers is integrated, in diameters of the finer of the two.
struct ContactSampling {
  double within_yarn = 0.5;      ///< fibers run side by side
  double between_yarns = 0.125;  ///< fibers cross
};

/// Span of a fiber against the near part of another fiber's endless chain, found at span `other` shifted by the image's periods.
struct SpanContact {
  std::uint32_t span = 0, other = 0;
  std::int32_t image_x = 0, image_y = 0;
  double share = 0.5;  ///< of the two fibers' contact that the points of this span stand for; 0.5 but where one of the two bends sharply
};

/// All contacts that can come about while no node moves by more than skin/2 from where it was.
struct ContactList {
  double skin = 0;  ///< [m]
  ContactSampling sampling;
  std::vector<SpanContact> contacts;      ///< sorted by span
  std::vector<std::size_t> first_sample;  ///< of each contact among the samples of all; size contacts + 1
  std::vector<double> gap;   ///< of each sample at `built_at`: its distance from a touch, below 0 if it touches or has no closest point [m]
  Eigen::VectorXd built_at;  ///< unknowns

  /// Whether a node has moved, or the cell grown, too far for this list.
  [[nodiscard]] bool late(const Cell& cell, const Eigen::VectorXd& q) const;
};

/// Contacts of a cell at `q` (cell grid over spans, periodic in x and y). Where an axis bends toward a point of another fiber with a radius
/// as small as their distance, as a fiber does that turns around another, the closest point to that is not unique: it would jump, and the
/// energy with it. There the points of the sharply bent fiber stand for the contact alone. The shares are those at `q`, and do not change
/// while the list lasts.
ContactList find_contacts(const Cell& cell, const Eigen::VectorXd& q, double skin, const ContactSampling& sampling = {});

/// Zero Hessian with room for bars, bending, platens, free lengths and all contacts in the list, as they lie now and a little aside.
SparseHessian hessian_for(const Cell& cell, const ContactList& list, const Eigen::VectorXd& q);

/// Parts of the potential energy [J].
struct EnergyParts {
  double bars = 0, bending = 0, contact = 0;
  double tension = 0;  ///< prescribed tensions times the rest length in the cell beyond that of a straight fiber
  double platens = 0;  ///< contact with them, and pressure times volume between them
  double loads = 0;    ///< minus the loads times what the cell has grown by
  [[nodiscard]] double sum() const { return bars + bending + contact + tension + platens + loads; }
};

/// What the contacts are like at a place.
struct ContactState {
  double overlap_max = 0;        ///< in sums of two radii
  std::size_t touching = 0;      ///< sample points
  std::vector<double> overlaps;  ///< per sample of the list, at most 0 where apart; only where asked for [m]
  bool want_overlaps = false;
};

/// Bars between the nodes: U = E A rho psi(e), e = l/rho - 1, with rho the rest length; psi'' = 1 in tension and the compression factor in
/// compression, linear in between within the cell's slack strain.
/// Under a prescribed tension T the rest length is free: all of a fiber's bars share what it draws in, w, as rho = rho_0 (1 + w / sum
/// rho_0), at the price T* (sum rho - L), with L the given length of the cell and T* = T + T^2/(2 E A). For one bar the least U over rho is
/// then T (l - L): a string of constant tension. One unknown for the whole fiber, and not one per bar, holds the nodes in place along it.
/// Such bars are linear in compression too, which none of them is at a minimum.
double bar_energy(const Cell& cell, const Unknowns& unknowns, const Eigen::VectorXd& q, Derivatives want, double* tension_work = nullptr);

/// Strain of a bar of given rest length that is under a tension [N], compression being negative.
double strain_under(const FiberType& type, double tension, double slack_strain);

/// Lays the fibers' axes through points, one for each node, and sets the rest lengths so that the bars have these strains (nodes) there.
/// Returns the nodes.
std::vector<Vec3> lay_axes(Cell& cell, const std::vector<Vec3>& points, const std::vector<double>& strain);

/// Tension of the bar from each node to the next [N].
std::vector<double> bar_tensions(const Cell& cell, const Unknowns& unknowns, const Eigen::VectorXd& q);

/// Bending: U = sum over nodes E I |x_0 - 2 x_1 + x_2|^2 / (2 h^3), with h the mean rest length of the two bars; that is E I kappa^2 h / 2
/// for bars of equal length, and quadratic.
double bending_energy(const Cell& cell, const Eigen::VectorXd& q, Derivatives want);

/// Line contact, weave::PairLaw per length of fiber, integrated at points of both fibers against the closest point of the other's axis,
/// each side with its share in the list. U is a function of positions alone while the closest points are unique and all shares one half.
double contact_energy(const Cell& cell, const ContactList& list, const Eigen::VectorXd& q, Derivatives want, ContactState* state = nullptr);

/// Platens: rigid planes at heights that are unknowns, pressed together by the cell's pressure p: U = p area (z_upper - z_lower) + contact.
/// The area is that of the given lengths, also where these are free: a force that followed the area would do work along x and y.
/// A fiber and its mirror image meet in the plane between them, so contact with a rigid plane is half of the contact of the two, at twice
/// the overlap.
double platen_energy(const Cell& cell, const Unknowns& unknowns, const Eigen::VectorXd& q, Derivatives want);

/// Minus the loads on the cell times what its free lengths have grown by.
double load_energy(const Cell& cell, const Unknowns& unknowns, const Eigen::VectorXd& q, Derivatives want);

/// Forces along x and along y that a cell at `q` bears: the derivative of its energy, without that of loads, by its lengths, rest lengths
/// and platens staying as they are [N].
Eigen::Vector2d borne_loads(const Cell& cell, const Eigen::VectorXd& q, const ContactSampling& sampling = {});

/// The whole potential.
EnergyParts potential(const Cell& cell, const Unknowns& unknowns, const ContactList& list, const Eigen::VectorXd& q, Derivatives want,
                      ContactState* state = nullptr);

}  // namespace relax
