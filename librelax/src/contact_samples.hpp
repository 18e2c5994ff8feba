#pragma once
#include <vector>

#include "relax/energy.hpp"

namespace relax {

/// Number of points, evenly spread over a span, at which its contact with another fiber is evaluated.
int samples_on(const Cell& cell, std::uint32_t span, std::uint32_t other, const ContactSampling& sampling);

/// The distance of each sample of a contact from a touch at `q`, as in ContactList [m].
void measure_gaps(const Cell& cell, const Eigen::VectorXd& q, const SpanContact& contact, const ContactSampling& sampling,
                  std::vector<double>& gap);

/// Sets which samples are whose.
void number_samples(const Cell& cell, ContactList& list);

/// By how much the cell has grown since a list was built: so much an image is farther from a node than it was [m].
double growth_since(const Cell& cell, const ContactList& list, const Eigen::VectorXd& q);

/// Sets the shares of the contacts of a list for a state at `q`.
void share_contacts(const Cell& cell, const Eigen::VectorXd& q, ContactList& list);

}  // namespace relax
