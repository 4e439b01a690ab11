// A thin film on the base, and under the coat, whose index is that over the film.
#if HAS_OPENPBR && ANY_FILM
// Sets the film once the dielectric's index is known. It is refracted through as without the film, whatever its own index.
void openpbr_film(Material m, inout Surface s) {
    film_surface(m, s);
    if (s.film <= 0.0) return;
#if HAS_CLEARCOAT
    s.film_outer = mix(1.0, max(m.coat_ior, 1.0), m.clearcoat * (1.0 - s.transmission));
#endif
#if HAS_FILM
    s.film_bends = s.turned_out ? 1.0 / s.eta_outside : s.eta_outside;
    // A coat that is denser than the base does not reflect all of slanting light: its index has been turned over.
    s.film_base = s.film_outer * s.film_bends;
    if (!s.turned_out && m.ior < s.film_outer) s.film_base = max(1.0, s.film_outer / s.eta_outside);
#endif
#if HAS_METAL_FILM
    film_metal_index(s.specular_weight * s.base_color, s.specular_color, s.film_outer, s);
#endif
}
#endif
