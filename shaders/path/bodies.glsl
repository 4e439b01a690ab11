// The bodies around a ray, where some have priorities: of those that overlap the highest is there, as nested dielectrics
// [Schmidt & Budge 2002, "Simple nested dielectrics in ray traced images"]. A boundary inside a higher body is passed as if
// nothing were there, and what lies on both sides of any other one gives its index. Of bodies with the same priority the
// one that was entered last is there.
#if HAS_PRIORITIES
const int BODIES_MOST = 4; // around a ray; beyond, the lowest ones are forgotten

// Where a texture gives bodies their index or their rates (BODIES_TEXTURED), these are those of the place where the ray
// entered, and are kept; else those of the shape's material, which take no registers.
struct Bodies {
    uvec4 ids; // the highest first: 1 + the shape, 0: none
#if BODIES_TEXTURED
    vec4 indices;  // of refraction
    mat4x3 rates;  // of their materials' extinction, 1/m
    mat4x3 scattering;
    vec4 forward;  // mean cosine times the mean of scattering
#endif
};

Bodies bodies_none() {
#if BODIES_TEXTURED
    return Bodies(uvec4(0u), vec4(1.0), mat4x3(0.0), mat4x3(0.0), vec4(0.0));
#else
    return Bodies(uvec4(0u));
#endif
}

Bodies bodies_one(uint id, float index, vec3 rate, vec3 scattering, float forward) {
    Bodies b = bodies_none();
    b.ids.x = id;
#if BODIES_TEXTURED
    b.indices.x = index;
    b.rates[0] = rate;
    b.scattering[0] = scattering;
    b.forward.x = forward;
#endif
    return b;
}

float bodies_priority(uint id) { return body_load(id).priority; }

// The index of what is there.
float bodies_index(Bodies b) {
#if BODIES_TEXTURED
    return b.indices.x;
#else
    return b.ids.x == 0u ? 1.0 : material_index(material_pick(body_load(b.ids.x).material));
#endif
}

bool bodies_have(Bodies b, uint id) { return any(equal(b.ids, uvec4(id))); }

float bodies_count(Bodies b) { return dot(vec4(notEqual(b.ids, uvec4(0u))), vec4(1.0)); }

// Adds the first body of `one`.
Bodies bodies_with(Bodies b, Bodies one) {
    float priority = bodies_priority(one.ids.x);
    int at = BODIES_MOST;
    for (int i = BODIES_MOST - 1; i >= 0; i--) if (b.ids[i] == 0u || bodies_priority(b.ids[i]) <= priority) at = i;
    for (int i = BODIES_MOST - 1; i >= 0; i--) {
        if (i > at) {
            b.ids[i] = b.ids[max(i - 1, 0)];
#if BODIES_TEXTURED
            b.indices[i] = b.indices[max(i - 1, 0)];
            b.rates[i] = b.rates[max(i - 1, 0)];
            b.scattering[i] = b.scattering[max(i - 1, 0)];
            b.forward[i] = b.forward[max(i - 1, 0)];
#endif
        }
        if (i == at) {
            b.ids[i] = one.ids.x;
#if BODIES_TEXTURED
            b.indices[i] = one.indices.x;
            b.rates[i] = one.rates[0];
            b.scattering[i] = one.scattering[0];
            b.forward[i] = one.forward.x;
#endif
        }
    }
    return b;
}

// Takes a body away, if it is there.
Bodies bodies_without(Bodies b, uint id) {
    bool found = false;
    for (int i = 0; i < BODIES_MOST; i++) {
        found = found || b.ids[i] == id;
        if (found) {
            bool last = i == BODIES_MOST - 1;
            int next = min(i + 1, BODIES_MOST - 1);
            b.ids[i] = last ? 0u : b.ids[next];
#if BODIES_TEXTURED
            b.indices[i] = last ? 1.0 : b.indices[next];
            b.rates[i] = last ? vec3(0.0) : b.rates[next];
            b.scattering[i] = last ? vec3(0.0) : b.scattering[next];
            b.forward[i] = last ? 0.0 : b.forward[next];
#endif
        }
    }
    return b;
}

// Whether the boundary of a body is inside a higher one, or one that was entered later.
bool bodies_hide(Bodies b, uint id, bool behind) {
    bool other = b.ids.x != 0u && b.ids.x != id;
    bool higher = other && bodies_priority(b.ids.x) > bodies_priority(id);
    return higher || (behind && other && bodies_have(b, id));
}
#endif
