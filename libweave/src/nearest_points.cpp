#include "nearest_points.hpp"

namespace weave {

int NearestPoints::take(const ContactTarget& at, const LineContact& c) {
  Batch& b = batch_[batch_of(count_)];
  const int k = count_ % lanes;
  const Span span = at.g.span(at.model, at.model.fiber_of[c.span], c.span);
  Vec3 from_middle = contact_point(at.model, at.g, c) - span.middle;
  from_middle.y() -= c.image * at.model.period_y;
  b.from_middle.set(k, from_middle);
  b.span.set(k, span);
  last_ = &c;
  return count_++;
}

void NearestPoints::find(const ContactTarget& at) {
  while (count_ % lanes != 0) take(at, *last_);
  for (int first = 0; first < count_; first += lanes) {
    Batch& b = batch_[batch_of(first)];
    b.u = b.span.nearest(b.from_middle);
    b.separation = b.from_middle - b.span.from_middle(b.u);
    b.distance2 = b.separation.dot(b.separation);
    b.on_span = b.span.has(b.u);
  }
}

AxisPoint NearestPoints::operator[](int place) const {
  const Batch& b = batch_[batch_of(place)];
  const int k = place % lanes;
  return {b.u[k], b.separation[k], b.distance2[k]};
}

}  // namespace weave
