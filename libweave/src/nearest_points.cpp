#include "nearest_points.hpp"

namespace weave {

int NearestPoints::take(const ContactTarget& at, const LineContact& c) {
  Batch& b = batch_[batch_of(count_)];
  const int k = count_ % lanes;
  const Span& span = at.g.span[c.span];
  Vec3 from_middle = contact_point(at.g, c) - span.middle;
  from_middle.y() -= c.image * at.model.period_y;
  b.from_middle.set(k, from_middle);
  b.slope.set(k, span.slope);
  b.curve.set(k, span.curve);
  b.low[k] = span.low;
  b.high[k] = span.high;
  last_ = &c;
  return count_++;
}

void NearestPoints::find(const ContactTarget& at) {
  while (count_ % lanes != 0) take(at, *last_);
  for (int first = 0; first < count_; first += lanes) {
    Batch& b = batch_[batch_of(first)];
    const Numbers<lanes> slope2 = b.slope.dot(b.slope);
    const NearnessCubic<Numbers<lanes>> cubic{slope2, b.slope.dot(b.curve), b.curve.dot(b.curve)};
    b.u = nearest_on_spans<Numbers<lanes>, lanes>(cubic, b.from_middle.dot(b.slope), slope2 - b.from_middle.dot(b.curve));
    b.separation = b.from_middle - b.slope.times(b.u) - b.curve.times(0.5 * b.u * b.u);
    b.distance2 = b.separation.dot(b.separation);
    b.on_span = b.u >= b.low && b.u <= b.high;
  }
}

AxisPoint NearestPoints::operator[](int place) const {
  const Batch& b = batch_[batch_of(place)];
  const int k = place % lanes;
  return {b.u[k], b.separation[k], b.distance2[k]};
}

}  // namespace weave
