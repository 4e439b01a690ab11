// A disk is a quad with the bit ROUND: the ellipse that touches the four edges in their middles. It has the quad's
// plane, its normal and its texture coordinates, which are those of the square around the disk.

bool disk_is(Quad q) { return HAS_DISKS != 0 && (q.shape & ROUND) != 0u; }

// Whether the quad is there at a place along u and v, each 0..1.
bool disk_holds(Quad q, vec2 place) {
#if HAS_DISKS
    vec2 off = 2.0 * place - 1.0;
    return !disk_is(q) || dot(off, off) <= 1.0;
#else
    return true;
#endif
}
