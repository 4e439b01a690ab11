// Light that fibres reflect at grazing angles [Burley 2012, section 5.5]. The diffuse lobe samples it.
vec3 disney_sheen_eval(Surface s, float cos_d) { return s.sheen * fresnel_schlick(cos_d) * (1.0 - s.metallic); }
