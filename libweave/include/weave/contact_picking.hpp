#pragma once
#include "weave/contact.hpp"

namespace weave {

/// Fills the touched side of the active contacts and makes room for their reactions.
void index_targets(const Model& model, ActiveContacts& contacts);

/// Picks from the list what can touch while no node moves by more than skin/2, following each contact's closest points. Bits do not
/// depend on the number of threads.
void pick_active(const Model& model, const FiberGeometry& geometry, double skin, ContactList& contacts);

/// Finds the contacts with the reed that can come about while no fiber approaches it by more than the skin [m]; those that stand keep their
/// friction. active_x_max: nodes beyond it touch nothing [m].
void pick_on_reed(const Model& model, const FiberGeometry& geometry, double skin, double active_x_max, ContactList& contacts);

}  // namespace weave
