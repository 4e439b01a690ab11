// The sums of a pixel's samples, and how those of two sets of samples become one. gpu/picture/blocks.py has the same
// in numpy.
struct Accumulated {
    vec4 sum;     // radiance and alpha
    vec4 lost;    // the rounding error of the sum [Kahan 1965]
    vec4 moments; // second moments of the scaled radiance about its mean; w: samples
};

// Adds two compensated sums. Either may be the larger one, so the error of adding the sums is found by Knuth's TwoSum
// [The Art of Computer Programming, volume 2, 4.2.2, theorem B] and not by Kahan's shorter form.
void accumulated_add(inout Accumulated total, Accumulated block) {
    precise vec4 t = total.sum + block.sum;
    precise vec4 taken = t - total.sum;
    precise vec4 left = ((total.sum - (t - taken)) + (block.sum - taken)) - (total.lost + block.lost);
    precise vec4 sum = t + left;
    precise vec4 lost = (sum - t) - left;
    total.sum = sum;
    total.lost = lost;
}

// The mean radiance. In double precision, as otherwise the means of two sets of equal samples differ by a rounding error.
vec3 accumulated_mean(Accumulated part) {
    return vec3((dvec3(part.sum.rgb) - dvec3(part.lost.rgb)) / double(max(part.moments.w, 1.0)));
}

// The sums of the samples of both. Where a block has none, the total keeps its bits, and where the total has none, the
// block does. The second moment is that of [Chan, Golub and LeVeque 1979, eq. 2.1], which does not cancel.
Accumulated accumulated_merge(Accumulated total, Accumulated block, float moment_scale) {
    float na = total.moments.w, nb = block.moments.w, n = na + nb;
    Accumulated both = total;
    accumulated_add(both, block);
    precise vec3 delta = (accumulated_mean(block) - accumulated_mean(total)) * moment_scale;
    precise vec3 second = total.moments.rgb + block.moments.rgb + delta * delta * (na * (nb / max(n, 1.0)));
    both.moments = vec4(second, n);
    if (na == 0.0) both = block;
    if (nb == 0.0) both = total;
    return both;
}
