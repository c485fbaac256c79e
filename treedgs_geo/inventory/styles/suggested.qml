<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>
<qgis labelsEnabled="0" minScale="100000000" styleCategories="LayerConfiguration|Symbology|Labeling|Fields|Forms|MapTips|AttributeTable|Rendering" simplifyMaxScale="1" symbologyReferenceScale="-1" simplifyDrawingHints="1" simplifyLocal="1" simplifyAlgorithm="0" maxScale="0" simplifyDrawingTol="1" version="3.22.16-Białowieża" readOnly="0" hasScaleBasedVisibilityFlag="0">
  <flags>
    <Identifiable>1</Identifiable>
    <Removable>1</Removable>
    <Searchable>1</Searchable>
    <Private>0</Private>
  </flags>
  <renderer-v2 enableorderby="0" referencescale="-1" type="singleSymbol" symbollevels="0" forceraster="0">
    <symbols>
      <symbol type="line" force_rhr="0" name="0" alpha="1" clip_to_extent="1">
        <data_defined_properties>
          <Option type="Map">
            <Option type="QString" name="name" value=""/>
            <Option name="properties"/>
            <Option type="QString" name="type" value="collection"/>
          </Option>
        </data_defined_properties>
        <layer class="SimpleLine" locked="0" pass="0" enabled="1">
          <Option type="Map">
            <Option type="QString" name="align_dash_pattern" value="0"/>
            <Option type="QString" name="capstyle" value="square"/>
            <Option type="QString" name="customdash" value="5;2"/>
            <Option type="QString" name="customdash_map_unit_scale" value="3x:0,0,0,0,0,0"/>
            <Option type="QString" name="customdash_unit" value="MM"/>
            <Option type="QString" name="dash_pattern_offset" value="0"/>
            <Option type="QString" name="dash_pattern_offset_map_unit_scale" value="3x:0,0,0,0,0,0"/>
            <Option type="QString" name="dash_pattern_offset_unit" value="MM"/>
            <Option type="QString" name="draw_inside_polygon" value="0"/>
            <Option type="QString" name="joinstyle" value="bevel"/>
            <Option type="QString" name="line_color" value="106,61,154,255"/>
            <Option type="QString" name="line_style" value="dash"/>
            <Option type="QString" name="line_width" value="0.6"/>
            <Option type="QString" name="line_width_unit" value="MM"/>
            <Option type="QString" name="offset" value="0"/>
            <Option type="QString" name="offset_map_unit_scale" value="3x:0,0,0,0,0,0"/>
            <Option type="QString" name="offset_unit" value="MM"/>
            <Option type="QString" name="ring_filter" value="0"/>
            <Option type="QString" name="trim_distance_end" value="0"/>
            <Option type="QString" name="trim_distance_end_map_unit_scale" value="3x:0,0,0,0,0,0"/>
            <Option type="QString" name="trim_distance_end_unit" value="MM"/>
            <Option type="QString" name="trim_distance_start" value="0"/>
            <Option type="QString" name="trim_distance_start_map_unit_scale" value="3x:0,0,0,0,0,0"/>
            <Option type="QString" name="trim_distance_start_unit" value="MM"/>
            <Option type="QString" name="tweak_dash_pattern_on_corners" value="0"/>
            <Option type="QString" name="use_custom_dash" value="0"/>
            <Option type="QString" name="width_map_unit_scale" value="3x:0,0,0,0,0,0"/>
          </Option>
          <prop v="0" k="align_dash_pattern"/>
          <prop v="square" k="capstyle"/>
          <prop v="5;2" k="customdash"/>
          <prop v="3x:0,0,0,0,0,0" k="customdash_map_unit_scale"/>
          <prop v="MM" k="customdash_unit"/>
          <prop v="0" k="dash_pattern_offset"/>
          <prop v="3x:0,0,0,0,0,0" k="dash_pattern_offset_map_unit_scale"/>
          <prop v="MM" k="dash_pattern_offset_unit"/>
          <prop v="0" k="draw_inside_polygon"/>
          <prop v="bevel" k="joinstyle"/>
          <prop v="106,61,154,255" k="line_color"/>
          <prop v="dash" k="line_style"/>
          <prop v="0.6" k="line_width"/>
          <prop v="MM" k="line_width_unit"/>
          <prop v="0" k="offset"/>
          <prop v="3x:0,0,0,0,0,0" k="offset_map_unit_scale"/>
          <prop v="MM" k="offset_unit"/>
          <prop v="0" k="ring_filter"/>
          <prop v="0" k="trim_distance_end"/>
          <prop v="3x:0,0,0,0,0,0" k="trim_distance_end_map_unit_scale"/>
          <prop v="MM" k="trim_distance_end_unit"/>
          <prop v="0" k="trim_distance_start"/>
          <prop v="3x:0,0,0,0,0,0" k="trim_distance_start_map_unit_scale"/>
          <prop v="MM" k="trim_distance_start_unit"/>
          <prop v="0" k="tweak_dash_pattern_on_corners"/>
          <prop v="0" k="use_custom_dash"/>
          <prop v="3x:0,0,0,0,0,0" k="width_map_unit_scale"/>
          <data_defined_properties>
            <Option type="Map">
              <Option type="QString" name="name" value=""/>
              <Option name="properties"/>
              <Option type="QString" name="type" value="collection"/>
            </Option>
          </data_defined_properties>
        </layer>
      </symbol>
    </symbols>
    <rotation/>
    <sizescale/>
  </renderer-v2>
  <blendMode>0</blendMode>
  <featureBlendMode>0</featureBlendMode>
  <layerOpacity>1</layerOpacity>
  <fieldConfiguration>
    <field configurationFlags="None" name="plot_id">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="field_id">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="tree_id">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="field_cm">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="dbh_cm">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="delta_cm">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="dbh_lo_cm">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="dbh_hi_cm">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="qc_flag">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="dist_m">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="margin">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="pair_status">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="note">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
  </fieldConfiguration>
  <aliases>
    <alias index="0" name="Plot" field="plot_id"/>
    <alias index="1" name="Field tree" field="field_id"/>
    <alias index="2" name="Measured tree" field="tree_id"/>
    <alias index="3" name="Field DBH [cm]" field="field_cm"/>
    <alias index="4" name="Measured DBH [cm]" field="dbh_cm"/>
    <alias index="5" name="Measured - field DBH [cm]" field="delta_cm"/>
    <alias index="6" name="DBH, lower end of 90 % interval [cm]" field="dbh_lo_cm"/>
    <alias index="7" name="DBH, upper end of 90 % interval [cm]" field="dbh_hi_cm"/>
    <alias index="8" name="Quality" field="qc_flag"/>
    <alias index="9" name="Distance after co-registration [m]" field="dist_m"/>
    <alias index="10" name="Log-odds against the next best pairing" field="margin"/>
    <alias index="11" name="Pair status" field="pair_status"/>
    <alias index="12" name="Note" field="note"/>
  </aliases>
  <defaults>
    <default applyOnUpdate="0" expression="" field="plot_id"/>
    <default applyOnUpdate="0" expression="" field="field_id"/>
    <default applyOnUpdate="0" expression="" field="tree_id"/>
    <default applyOnUpdate="0" expression="" field="field_cm"/>
    <default applyOnUpdate="0" expression="" field="dbh_cm"/>
    <default applyOnUpdate="0" expression="" field="delta_cm"/>
    <default applyOnUpdate="0" expression="" field="dbh_lo_cm"/>
    <default applyOnUpdate="0" expression="" field="dbh_hi_cm"/>
    <default applyOnUpdate="0" expression="" field="qc_flag"/>
    <default applyOnUpdate="0" expression="" field="dist_m"/>
    <default applyOnUpdate="0" expression="" field="margin"/>
    <default applyOnUpdate="0" expression="" field="pair_status"/>
    <default applyOnUpdate="0" expression="" field="note"/>
  </defaults>
  <constraints>
    <constraint constraints="0" exp_strength="0" unique_strength="0" field="plot_id" notnull_strength="0"/>
    <constraint constraints="0" exp_strength="0" unique_strength="0" field="field_id" notnull_strength="0"/>
    <constraint constraints="0" exp_strength="0" unique_strength="0" field="tree_id" notnull_strength="0"/>
    <constraint constraints="0" exp_strength="0" unique_strength="0" field="field_cm" notnull_strength="0"/>
    <constraint constraints="0" exp_strength="0" unique_strength="0" field="dbh_cm" notnull_strength="0"/>
    <constraint constraints="0" exp_strength="0" unique_strength="0" field="delta_cm" notnull_strength="0"/>
    <constraint constraints="0" exp_strength="0" unique_strength="0" field="dbh_lo_cm" notnull_strength="0"/>
    <constraint constraints="0" exp_strength="0" unique_strength="0" field="dbh_hi_cm" notnull_strength="0"/>
    <constraint constraints="0" exp_strength="0" unique_strength="0" field="qc_flag" notnull_strength="0"/>
    <constraint constraints="0" exp_strength="0" unique_strength="0" field="dist_m" notnull_strength="0"/>
    <constraint constraints="0" exp_strength="0" unique_strength="0" field="margin" notnull_strength="0"/>
    <constraint constraints="0" exp_strength="0" unique_strength="0" field="pair_status" notnull_strength="0"/>
    <constraint constraints="0" exp_strength="0" unique_strength="0" field="note" notnull_strength="0"/>
  </constraints>
  <constraintExpressions>
    <constraint exp="" field="plot_id" desc=""/>
    <constraint exp="" field="field_id" desc=""/>
    <constraint exp="" field="tree_id" desc=""/>
    <constraint exp="" field="field_cm" desc=""/>
    <constraint exp="" field="dbh_cm" desc=""/>
    <constraint exp="" field="delta_cm" desc=""/>
    <constraint exp="" field="dbh_lo_cm" desc=""/>
    <constraint exp="" field="dbh_hi_cm" desc=""/>
    <constraint exp="" field="qc_flag" desc=""/>
    <constraint exp="" field="dist_m" desc=""/>
    <constraint exp="" field="margin" desc=""/>
    <constraint exp="" field="pair_status" desc=""/>
    <constraint exp="" field="note" desc=""/>
  </constraintExpressions>
  <expressionfields/>
  <attributetableconfig sortExpression="" sortOrder="0" actionWidgetStyle="dropDown">
    <columns/>
  </attributetableconfig>
  <conditionalstyles>
    <rowstyles/>
    <fieldstyles/>
  </conditionalstyles>
  <storedexpressions/>
  <editform tolerant="1"></editform>
  <editforminit/>
  <editforminitcodesource>0</editforminitcodesource>
  <editforminitfilepath></editforminitfilepath>
  <editforminitcode><![CDATA[]]></editforminitcode>
  <featformsuppress>0</featformsuppress>
  <editorlayout>generatedlayout</editorlayout>
  <editable/>
  <labelOnTop/>
  <reuseLastValue/>
  <dataDefinedFieldProperties/>
  <widgets/>
  <previewExpression>"plot_id" || ': ' || "field_id" || ' - ' || "tree_id"</previewExpression>
  <mapTip>Field tree [% "field_id" %], measured tree [% "tree_id" %]?&lt;br>[% "note" %]</mapTip>
  <layerGeometryType>1</layerGeometryType>
</qgis>
